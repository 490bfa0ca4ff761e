#include "services/reconstruction/trust.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <vector>

#include "services/common/geometry/dense_solvers.h"
#include "services/reconstruction/clipping.h"
#include "services/reconstruction/frequency_agreement.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/pixel_sampler.h"

namespace forgescan {
namespace {

constexpr double kFullScaleDn = 255;

// Median of the rms of n normal values of standard deviation 1: what a robust rms divides by.
double MedianOfRms(int n) { return n == 1 ? 0.6745 : 0.8326; }

// Collects the figures pixel by pixel.
class TrustSampler {
 public:
  // cut_dn: where the camera cuts off.
  TrustSampler(std::span<const cv::Mat> frames, const FringeDecoder& decoder,
               const ReconstructionConfig& config, double cut_dn)
      : pixel_(frames, decoder.estimator(), GreyScale(frames[0], config)),
        decoder_(decoder),
        noise_(config.noise),
        uncut_dn_(kUncutShare * cut_dn),
        errors_(decoder.estimator().cosine.rows()) {}

  void AddSaturated() { ++saturated_; }

  void Add(int row, int column, double coordinate_px) {
    const Eigen::VectorXd& grey = pixel_.Grey(row, column);
    const PhaseEstimator& estimator = decoder_.estimator();
    const std::vector<std::complex<double>>& phasors = pixel_.Phasors(row, column);
    disagreement_.Add(DisagreementRad(decoder_, phasors, coordinate_px));
    predicted_square_ += PredictedSquare(grey, phasors);
    AddDrift(grey, phasors);
    ++lit_;
    if (estimator.redundancy > 0) {
      AddResidual(estimator.residual * grey, phasors);
    }
  }

  Result<TrustFigures> Finish() const {
    if (lit_ == 0) {
      return Fail(ErrorCode::kDegenerate, "no pixel shows fringes ({} of the sampled ones are saturated)",
                  saturated_);
    }
    TrustFigures figures;
    figures.disagreement_rad = disagreement_.Median() / MedianOfRms(decoder_.table().other_count);
    figures.predicted_disagreement_rad = std::sqrt(predicted_square_ / static_cast<double>(lit_));
    figures.saturated_fraction = static_cast<double>(saturated_) / static_cast<double>(saturated_ + lit_);
    FinishHarmonic(figures);
    if (decoder_.pattern().reference_frame_index) {
      figures.uncut_reference_fraction =
          static_cast<double>(drift_ratio_.total()) / static_cast<double>(lit_);
    }
    if (drift_ratio_.total() > 0) {
      const auto& gains = decoder_.estimator().drift_gain;
      figures.drift_dn = drift_dn_.Median();
      figures.drift_phase_rad =
          std::abs(drift_ratio_.Median()) * *std::max_element(gains.begin(), gains.end());
    }
    return figures;
  }

 private:
  static constexpr double kUncutShare = 0.98;  // of cut_dn: a brighter reference may be cut off
  static constexpr double kBlackDn = 2;        // a darker one may lie below what the camera shows

  // The reference shows the background at its own time, the fringes at theirs.
  void AddDrift(const Eigen::VectorXd& grey, const std::vector<std::complex<double>>& phasors) {
    const PatternSet& pattern = decoder_.pattern();
    const PhaseEstimator& estimator = decoder_.estimator();
    if (!pattern.reference_frame_index) return;
    const double reference = grey(*pattern.reference_frame_index);
    if (reference > uncut_dn_ || reference < kBlackDn) return;
    const double modulation = std::abs(phasors[0]);
    double drift = 0;
    if (estimator.drift) {
      drift = estimator.drift->dot(grey);
    } else {
      const double level =
          estimator.background.row(0).dot(grey) + pattern.ReferencePerModulation() * modulation;
      const auto times = Eigen::VectorXd::LinSpaced(grey.size(), 0, static_cast<double>(grey.size() - 1));
      drift = (reference - level) / (*pattern.reference_frame_index - estimator.background.row(0).dot(times));
    }
    drift_dn_.Add(drift);
    drift_ratio_.Add(drift / modulation);
  }

  // Without a matrix of its own: it is done for every sample.
  double PredictedSquare(const Eigen::VectorXd& grey, const std::vector<std::complex<double>>& phasors) {
    const PhaseEstimator& estimator = decoder_.estimator();
    double sum = 0;
    for (Eigen::Index i = 0; i < grey.size(); ++i) {
      for (Eigen::Index j = 0; j < errors_.size(); ++j) {
        const std::complex<double>& p = phasors[static_cast<std::size_t>(j)];
        errors_(j) = (p.real() * estimator.sine(j, i) - p.imag() * estimator.cosine(j, i)) / std::norm(p);
      }
      const double variance = noise_.read_noise_dn * noise_.read_noise_dn + noise_.gain_dn * grey(i);
      sum += variance * SquaredDisagreement(decoder_.table(), errors_);
    }
    return sum;
  }

  void AddResidual(const Eigen::VectorXd& residual, const std::vector<std::complex<double>>& phasors) {
    const Eigen::MatrixX2d harmonic =
        decoder_.estimator().residual * HarmonicFrames(decoder_.pattern(), phasors);
    normal_ += harmonic.transpose() * harmonic;
    right_side_ += harmonic.transpose() * residual;
    residual_square_ += residual.squaredNorm();
    for (const auto& phasor : phasors) {
      modulation_square_ += std::norm(phasor);
    }
  }

  void FinishHarmonic(TrustFigures& figures) const {
    if (decoder_.estimator().redundancy == 0) {
      return;
    }
    // The frames show the harmonic only if a good part of it (here 1 %) is not swallowed by the model's own
    // unknowns.
    constexpr double kMinVisible = 0.01;
    const bool visible = normal_.trace() / 2 > kMinVisible * modulation_square_;
    double explained = 0;
    if (visible) {
      constexpr double kFree = 1e-12;  // of a set that shows one of the two parts only
      const Eigen::Vector2d ratio = LeastNormSolution(normal_, right_side_, kFree);
      figures.second_harmonic_ratio = ratio.norm();
      explained = ratio.dot(right_side_);
    }
    const double freedom = static_cast<double>(lit_) * decoder_.estimator().redundancy;
    figures.noise_dn = std::sqrt(std::max(residual_square_ - explained, 0.0) / freedom);
  }

  PixelSampler pixel_;
  const FringeDecoder& decoder_;
  CameraNoise noise_;
  double uncut_dn_;
  Eigen::VectorXd errors_;  // of the phases, scratch
  HistogramMedian disagreement_{0, 4, 40000};
  HistogramMedian drift_dn_{-32, 32, 32000};
  HistogramMedian drift_ratio_{-0.5, 0.5, 20000};
  long lit_ = 0;
  long saturated_ = 0;
  double predicted_square_ = 0;
  double residual_square_ = 0;
  double modulation_square_ = 0;
  Eigen::Matrix2d normal_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right_side_ = Eigen::Vector2d::Zero();
};

bool IsLit(MaskCause cause) {
  return cause != MaskCause::kSaturated && cause != MaskCause::kLowModulation && cause != MaskCause::kNoisy;
}

// visit(row, column, cause) on a regular grid.
template <typename Visit>
void ForSamples(const DecodedView& view, const Visit& visit) {
  const int step = SamplingStep(view.cause.size());
  for (int row = step / 2; row < view.cause.rows; row += step) {
    for (int column = step / 2; column < view.cause.cols; column += step) {
      visit(row, column, static_cast<MaskCause>(view.cause(row, column)));
    }
  }
}

// Where the camera cuts off, by the fringes or by the reference frame: full scale if nothing shows it.
double CutDn(std::span<const cv::Mat> frames, const DecodedView& view, const PatternSet& pattern,
             const ReconstructionConfig& config) {
  const double fringes_dn = view.clipping_dn.value_or(kFullScaleDn);
  if (!pattern.reference_frame_index) {
    return fringes_dn;
  }
  const cv::Mat& reference = frames[static_cast<std::size_t>(*pattern.reference_frame_index)];
  const bool is_narrow = reference.depth() == CV_8U;
  Histogram lit(is_narrow ? 256 : 65536);
  ForSamples(view, [&](int row, int column, MaskCause cause) {
    if (IsLit(cause)) {
      ++lit[is_narrow ? reference.at<std::uint8_t>(row, column) : reference.at<std::uint16_t>(row, column)];
    }
  });
  const auto level = ReferenceClippingLevel(lit);
  return level ? std::min(fringes_dn, GreyScale(reference, config) * *level) : fringes_dn;
}

}  // namespace

Result<TrustFigures> MeasureTrust(std::span<const cv::Mat> frames, const DecodedView& view,
                                  const FringeDecoder& decoder, const ReconstructionConfig& config) {
  TrustSampler sampler(frames, decoder, config, CutDn(frames, view, decoder.pattern(), config));
  ForSamples(view, [&](int row, int column, MaskCause cause) {
    if (cause == MaskCause::kSaturated) {
      sampler.AddSaturated();
    } else if (IsLit(cause)) {
      sampler.Add(row, column, static_cast<double>(view.coordinate_px(row, column)));
    }
  });
  ASSIGN_OR_RETURN(auto figures, sampler.Finish());
  constexpr double kMinGain = 0.1;  // below it the frames cancel the 2nd harmonic
  if (const double gain = HarmonicGain(decoder); gain > kMinGain) {
    const double excess = std::max(
        0.0, std::pow(figures.disagreement_rad, 2) - std::pow(figures.predicted_disagreement_rad, 2));
    figures.suspected_second_harmonic = std::sqrt(excess) / gain;
  }
  return figures;
}

}  // namespace forgescan
