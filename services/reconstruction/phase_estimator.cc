#include "services/reconstruction/phase_estimator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

bool ModelsDrift(const PatternSet& pattern) {
  return pattern.background == Background::kShared && pattern.reference_frame_index &&
         pattern.reference_light == ReferenceLight::kMidGrey;
}

Eigen::VectorXd Times(const PatternSet& pattern) {
  return Eigen::VectorXd::LinSpaced(pattern.frame_count(), 0, pattern.frame_count() - 1);
}

// Unknowns: the backgrounds first, then C and S of each frequency, then the drift.
Eigen::MatrixXd DesignMatrix(const PatternSet& pattern, int backgrounds) {
  const int frequencies = static_cast<int>(pattern.frequencies.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(
      pattern.frame_count(), backgrounds + 2 * frequencies + (ModelsDrift(pattern) ? 1 : 0));
  for (int j = 0; j < frequencies; ++j) {
    const FringeFrequency& frequency = pattern.frequencies[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      const int frame = frequency.frame_index[i];
      design(frame, backgrounds == 1 ? 0 : j) = 1;
      design(frame, backgrounds + 2 * j) = std::cos(frequency.shift_rad[i]);
      design(frame, backgrounds + 2 * j + 1) = -std::sin(frequency.shift_rad[i]);
    }
  }
  if (ModelsDrift(pattern)) {
    design(*pattern.reference_frame_index, 0) = 1;
    design.rightCols<1>() = Times(pattern).array() - Times(pattern).mean();
  }
  return design;
}

std::vector<double> DriftGains(const PhaseEstimator& estimator, const PatternSet& pattern) {
  std::vector<double> gains;
  for (Eigen::Index j = 0; j < estimator.cosine.rows(); ++j) {
    gains.push_back(
        std::hypot(estimator.cosine.row(j).dot(Times(pattern)), estimator.sine.row(j).dot(Times(pattern))));
  }
  return gains;
}

std::vector<double> FusionWeights(const PhaseEstimator& estimator, const PatternSet& pattern) {
  std::vector<double> weights;
  double sum = 0;
  for (std::size_t j = 0; j < pattern.frequencies.size(); ++j) {
    const double noise = std::pow(estimator.PhaseNoise(static_cast<int>(j)), 2);
    const double scale = pattern.frequencies[j].period_px / pattern.frequencies[j].modulation_ratio;
    weights.push_back(1 / (noise * scale * scale));
    sum += weights.back();
  }
  for (double& weight : weights) {
    weight /= sum;
  }
  return weights;
}

}  // namespace

double PhaseEstimator::PhaseNoise(int frequency) const {
  return std::sqrt((cosine.row(frequency).squaredNorm() + sine.row(frequency).squaredNorm()) / 2);
}

double PhaseEstimator::PhaseVariance(int frequency, double phase_rad) const {
  return (std::cos(phase_rad) * sine.row(frequency) - std::sin(phase_rad) * cosine.row(frequency))
      .squaredNorm();
}

double PhaseEstimator::ReferenceNoise(int frequency, double per_modulation) const {
  constexpr int kPhases = 64;
  double worst = 0;
  for (int k = 0; k < kPhases; ++k) {
    const double phase = 2 * std::numbers::pi * k / kPhases;
    const Eigen::RowVectorXd modulation =
        std::cos(phase) * cosine.row(frequency) + std::sin(phase) * sine.row(frequency);
    worst = std::max(worst, (background.row(frequency) + per_modulation * modulation).norm());
  }
  return worst;
}

Result<PhaseEstimator> MakePhaseEstimator(const PatternSet& pattern) {
  RETURN_IF_ERROR(Check(pattern));
  const int frequencies = static_cast<int>(pattern.frequencies.size());
  const int backgrounds = pattern.background == Background::kShared ? 1 : frequencies;
  const Eigen::MatrixXd design = DesignMatrix(pattern, backgrounds);
  constexpr double kSingular = 1e-3;  // shifts nearer to it would multiply the noise by hundreds
  const auto [solution, rank] = PseudoInverseOf(design, kSingular);
  if (rank < design.cols()) {
    return Fail(ErrorCode::kDegenerate,
                "the shifts of the pattern set do not determine its {} unknowns (rank {})", design.cols(),
                rank);
  }
  PhaseEstimator estimator;
  estimator.cosine.resize(frequencies, pattern.frame_count());
  estimator.sine.resize(frequencies, pattern.frame_count());
  estimator.background.resize(frequencies, pattern.frame_count());
  for (int j = 0; j < frequencies; ++j) {
    estimator.background.row(j) = solution.row(backgrounds == 1 ? 0 : j);
    estimator.cosine.row(j) = solution.row(backgrounds + 2 * j);
    estimator.sine.row(j) = solution.row(backgrounds + 2 * j + 1);
  }
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(pattern.frame_count(), pattern.frame_count());
  estimator.residual = identity - design * solution;
  const bool has_other_frame = pattern.reference_frame_index && !ModelsDrift(pattern);
  if (has_other_frame) {
    estimator.residual.row(*pattern.reference_frame_index).setZero();  // not part of the model
  }
  if (ModelsDrift(pattern)) {
    estimator.drift = solution.bottomRows<1>();
  }
  estimator.redundancy = pattern.frame_count() - (has_other_frame ? 1 : 0) - static_cast<int>(design.cols());
  estimator.drift_gain = DriftGains(estimator, pattern);
  estimator.fusion = FusionWeights(estimator, pattern);
  return estimator;
}

}  // namespace forgescan
