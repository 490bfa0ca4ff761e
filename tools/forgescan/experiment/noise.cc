// Phase noise of the reduced and the full set against the Cramer-Rao bound, and what the decoder makes of it.
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

#include "services/reconstruction/fringe_decoder.h"
#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/experiment/experiment.h"
#include "tools/forgescan/experiment/synthetic_frames.h"

namespace forgescan {
namespace {

constexpr int kBins = 24;
constexpr double kNoiseShare = 0.01;  // sigma / B: small enough that the estimator is as good as linear
constexpr std::size_t kFrequencies = 3;
using Triple = std::array<double, kFrequencies>;

struct SetOfFrames {
  const char* name;
  PatternSet pattern;
  PhaseEstimator estimator;
};

Result<SetOfFrames> Make(const char* name, Background background) {
  SetOfFrames set{name, SyntheticPattern(background), {}};
  ASSIGN_OR_RETURN(set.estimator, MakePhaseEstimator(set.pattern));
  return set;
}

// The derivatives of all frames by the unknowns, B = 1: backgrounds (one, or one a frequency), modulations,
// then `tail` columns that the caller fills by the derivative of the phases.
Eigen::MatrixXd Derivatives(const PatternSet& pattern, const Triple& phase, const Eigen::MatrixXd& by_tail) {
  const Eigen::Index backgrounds = pattern.background == Background::kShared ? 1 : kFrequencies;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(
      pattern.frame_count(), backgrounds + static_cast<Eigen::Index>(kFrequencies) + by_tail.cols());
  for (std::size_t j = 0; j < kFrequencies; ++j) {
    const FringeFrequency& frequency = pattern.frequencies[j];
    const auto column = static_cast<Eigen::Index>(j);
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      const double angle = phase[j] + frequency.shift_rad[i];
      auto row = rows.row(frequency.frame_index[i]);
      row[std::min(column, backgrounds - 1)] = 1;
      row[backgrounds + column] = std::cos(angle);
      row.tail(by_tail.cols()) = -std::sin(angle) * by_tail.row(column);
    }
  }
  return rows;
}

// Variances of the last unknowns, sigma = B = 1: the inverse of the Fisher information.
Eigen::VectorXd Bound(const Eigen::MatrixXd& derivatives, Eigen::Index count) {
  return (derivatives.transpose() * derivatives).inverse().diagonal().tail(count);
}

Triple PhaseBound(const PatternSet& pattern, double phase) {
  const Eigen::VectorXd bound =
      Bound(Derivatives(pattern, {phase, phase, phase}, Eigen::Matrix3d::Identity()), 3);
  return {bound[0], bound[1], bound[2]};
}

Triple PhasesAt(const PatternSet& pattern, double column_px) {
  Triple phase{};
  for (std::size_t j = 0; j < kFrequencies; ++j) phase[j] = PhaseAt(pattern.frequencies[j], column_px);
  return phase;
}

// How much each phase turns when the first one turns by 1.
Eigen::Vector3d PhaseRatios(const PatternSet& pattern) {
  Eigen::Vector3d ratio;
  for (std::size_t j = 0; j < kFrequencies; ++j) {
    ratio[static_cast<Eigen::Index>(j)] = pattern.frequencies[0].period_px / pattern.frequencies[j].period_px;
  }
  return ratio;
}

// Of the coordinate, as phase of the first frequency.
double CoordinateBound(const PatternSet& pattern, double column_px) {
  return Bound(Derivatives(pattern, PhasesAt(pattern, column_px), PhaseRatios(pattern)), 1)[0];
}

// Errors of the production estimator over sigma / B, for one draw of the frames' noise.
Triple DrawErrors(const SetOfFrames& set, const Triple& phase, RandomStream& random) {
  Eigen::VectorXd grey = Eigen::VectorXd::Zero(set.pattern.frame_count());
  for (std::size_t j = 0; j < kFrequencies; ++j) {
    const FringeFrequency& frequency = set.pattern.frequencies[j];
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      grey[frequency.frame_index[i]] =
          1.2 + std::cos(phase[j] + frequency.shift_rad[i]) + kNoiseShare * random.Gaussian();
    }
  }
  const Eigen::VectorXd cosine = set.estimator.cosine * grey, sine = set.estimator.sine * grey;
  Triple error{};
  for (std::size_t j = 0; j < kFrequencies; ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    error[j] = Wrapped(std::atan2(sine[row], cosine[row]) - phase[j]) / kNoiseShare;
  }
  return error;
}

struct Curve {
  std::vector<double> phase_deg, bound, measured;  // standard deviations over sigma / B, by bins of phase
  double worst_percent = 0;                        // of measured against bound
  double mean_bound = 0, mean_measured = 0;        // rms over the bins
};

std::array<Curve, kFrequencies> MeasureBins(const SetOfFrames& set, const ExperimentOptions& options) {
  std::array<Curve, kFrequencies> curves;
  for (int bin = 0; bin < kBins; ++bin) {
    RandomStream random = DrawsOf(options.seed, Draw::kGreyNoise, {bin, set.pattern.frame_count()});
    Triple squares{}, bounds{};
    for (int run = 0; run < options.runs; ++run) {
      const double phase = 2 * std::numbers::pi * (bin + random.Uniform()) / kBins;
      const Triple error = DrawErrors(set, {phase, phase, phase}, random);
      for (std::size_t j = 0; j < kFrequencies; ++j) squares[j] += error[j] * error[j] / options.runs;
    }
    constexpr int kSteps = 16;  // of the bound, which changes slowly, within a bin
    for (int i = 0; i < kSteps; ++i) {
      const Triple bound = PhaseBound(set.pattern, 2 * std::numbers::pi * (bin + (i + 0.5) / kSteps) / kBins);
      for (std::size_t j = 0; j < kFrequencies; ++j) bounds[j] += bound[j] / kSteps;
    }
    for (std::size_t j = 0; j < kFrequencies; ++j) {
      Curve& curve = curves[j];
      curve.phase_deg.push_back(360 * (bin + 0.5) / kBins);
      curve.bound.push_back(std::sqrt(bounds[j]));
      curve.measured.push_back(std::sqrt(squares[j]));
      curve.worst_percent =
          std::max(curve.worst_percent, 100 * std::abs(curve.measured.back() / curve.bound.back() - 1));
      curve.mean_bound += bounds[j] / kBins;
      curve.mean_measured += squares[j] / kBins;
    }
  }
  return curves;
}

struct Fused {
  double bound = 0, measured = 0;  // variances
};

Fused MeasureFused(const SetOfFrames& set, const ExperimentOptions& options) {
  RandomStream random = DrawsOf(options.seed, Draw::kGreyNoise, {-1, set.pattern.frame_count()});
  const Eigen::Vector3d ratio = PhaseRatios(set.pattern);
  Fused fused;
  for (int run = 0; run < options.runs; ++run) {
    const double column_px = random.Uniform(100, 1800);
    const Triple error = DrawErrors(set, PhasesAt(set.pattern, column_px), random);
    double sum = 0;
    for (std::size_t j = 0; j < kFrequencies; ++j) {
      sum += set.estimator.fusion[j] * error[j] / ratio[static_cast<Eigen::Index>(j)];
    }
    fused.measured += sum * sum / options.runs;
    fused.bound += CoordinateBound(set.pattern, column_px) / options.runs;
  }
  return fused;
}

std::vector<std::string> FusedRow(const SetOfFrames& set, const Fused& fused) {
  return {set.name, "coordinate of all three", fmt::format("{:.3f}", std::sqrt(fused.bound)),
          fmt::format("{:.3f}", std::sqrt(fused.measured)),
          fmt::format("{:+.1f} %", 100 * (std::sqrt(fused.measured / fused.bound) - 1))};
}

struct Decoded {
  double valid_share = 0, order_error_rate = 0, rms_px = 0, predicted_px = 0;
};

Result<Decoded> Decode(const SetOfFrames& set, double noise_share, std::uint64_t seed) {
  RampScene scene{.width_px = 2048, .height_px = 512, .seed = seed};
  scene.noise_dn = noise_share * scene.modulation_dn();
  ReconstructionConfig config;
  config.noise = {scene.noise_dn, 0};
  ASSIGN_OR_RETURN(const auto decoder, FringeDecoder::Create(set.pattern, config));
  ASSIGN_OR_RETURN(const DecodedView view, decoder.Decode(RampFrames(set.pattern, scene)));
  long valid = 0, wrong = 0;
  double squares = 0, predicted = 0;
  for (int y = 0; y < scene.height_px; ++y) {
    for (int x = 0; x < scene.width_px; ++x) {
      if (view.cause(y, x) != static_cast<std::uint8_t>(MaskCause::kValid)) continue;
      const double error_px = static_cast<double>(view.coordinate_px(y, x)) - RampColumnPx(scene, x, y);
      const bool is_wrong = std::abs(error_px) > 0.5 * set.pattern.frequencies[0].period_px;
      ++valid;
      wrong += is_wrong ? 1 : 0;
      squares += is_wrong ? 0 : error_px * error_px;
      predicted += static_cast<double>(view.VariancePx2(y, x));
    }
  }
  if (valid == 0) return Fail(ErrorCode::kDegenerate, "no pixel of the ramp was decoded");
  const auto count = static_cast<double>(valid);
  return Decoded{count / (2048.0 * 512.0), static_cast<double>(wrong) / count,
                 std::sqrt(squares / std::max(1.0, count - static_cast<double>(wrong))),
                 std::sqrt(predicted / count)};
}

Result<Table> DecoderTable(const std::vector<SetOfFrames>& sets, const ExperimentOptions& options,
                           std::vector<Goal>& goals) {
  Table table{
      {"decoder, 1 M pixels", "sigma/B", "decoded", "wrong fringe orders", "rms error px", "predicted px"},
      {}};
  for (const SetOfFrames& set : sets) {
    for (const double share : {0.01, 0.02, 0.03}) {
      ASSIGN_OR_RETURN(const Decoded decoded, Decode(set, share, options.seed));
      table.rows.push_back(
          {set.name, fmt::format("{:.2f}", share), fmt::format("{:.2f} %", 100 * decoded.valid_share),
           fmt::format("{:.1e}", decoded.order_error_rate), fmt::format("{:.4f}", decoded.rms_px),
           fmt::format("{:.4f}", decoded.predicted_px)});
      if (share == 0.03 && set.pattern.background == Background::kShared) {
        goals.push_back(
            {"wrong fringe orders of the reduced set at sigma/B 0.03", decoded.order_error_rate, 2e-5, ""});
      }
    }
  }
  return table;
}

std::vector<Series> SeriesOf(const std::array<Curve, kFrequencies>& curves, bool is_full) {
  std::vector<Series> series;
  const auto add = [&](const Curve& curve, const std::string& name, int colour) {
    series.push_back({name + ", bound", Mark::kLine, curve.phase_deg, curve.bound, colour});
    series.push_back({name + ", measured", Mark::kDots, curve.phase_deg, curve.measured, colour});
  };
  if (is_full) {
    add(curves[0], "full set", 2);
  } else {
    add(curves[0], "reduced, 3 frames", 0);
    add(curves[1], "reduced, 2 frames", 1);
  }
  return series;
}

}  // namespace

Result<ExperimentReport> RunNoise(const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(const SetOfFrames full, Make("full, 4-4-4", Background::kOwn));
  ASSIGN_OR_RETURN(const SetOfFrames reduced, Make("reduced, 3-2-2", Background::kShared));
  const std::vector<SetOfFrames> sets = {full, reduced};
  ExperimentReport report;
  report.question = fmt::format(
      "Phases of {} draws of Gaussian noise in each of {} bins of phase, estimated by the decoder's own "
      "matrices, against the Cramer-Rao bound (inverse Fisher information of backgrounds, modulations and "
      "phases). The noise of a phase is given over sigma/B, sigma the noise of a grey value.",
      options.runs, kBins);
  Table table{{"set", "unknown", "bound", "measured", "worst bin against bound"}, {}};
  Chart chart{"Phase noise by phase",
              {"phase, degrees", false, 0.0, 360.0},
              {"sigma of a phase over sigma/B", false, 0.0, 1.6}};
  double worst_percent = 0;
  for (const SetOfFrames& set : sets) {
    const auto curves = MeasureBins(set, options);
    for (std::size_t j = 0; j < kFrequencies; ++j) {
      table.rows.push_back({set.name, fmt::format("phase {}", j + 1),
                            fmt::format("{:.3f}", std::sqrt(curves[j].mean_bound)),
                            fmt::format("{:.3f}", std::sqrt(curves[j].mean_measured)),
                            fmt::format("{:.1f} %", curves[j].worst_percent)});
      worst_percent = std::max(worst_percent, curves[j].worst_percent);
    }
    table.rows.push_back(FusedRow(set, MeasureFused(set, options)));
    for (Series& series : SeriesOf(curves, set.pattern.background == Background::kOwn)) {
      chart.series.push_back(std::move(series));
    }
  }
  report.tables.push_back(table);
  report.goals.push_back({"noise of a phase against its bound, worst bin", worst_percent, 5, "%"});
  ASSIGN_OR_RETURN(Table decoder, DecoderTable(sets, options, report.goals));
  report.tables.push_back(std::move(decoder));
  report.remarks.push_back(
      fmt::format("With {} draws a bin scatters by {:.2f} % (one sigma) about its true noise.", options.runs,
                  100 / std::sqrt(2.0 * options.runs)));
  report.svg = SvgFile("noise", 900, 440, DrawChart(chart, {0, 0, 900, 440}));
  return report;
}

}  // namespace forgescan
