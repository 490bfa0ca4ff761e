#include "services/registration/correspondences.h"

#include <algorithm>
#include <cmath>

#include "services/common/parallel_blocks.h"

namespace forgescan {
namespace {

constexpr std::size_t kBlock = 512;     // points a thread takes at a time
constexpr double kBiweight = 4.685;     // 95 % efficiency for normal residuals
constexpr double kMadToSigma = 1.4826;  // for normal residuals
constexpr double kSmallestScaleMm =
    1e-3;  // rounding of single precision; keeps exact data from dividing by zero

// Median of absolute values; moves the values about.
double MedianOf(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool NormalsAgree(const ScanSample& sample, std::size_t i, const Eigen::Matrix3f& rotation,
                  const Eigen::Vector3f& model_normal, float min_cosine) {
  return sample.normals.empty() || (rotation * sample.normals[i]).dot(model_normal) >= min_cosine;
}

float Residual(const Pair& pair) { return (pair.point - pair.foot).dot(pair.normal); }

}  // namespace

std::vector<Pair> PairRoughly(const ScanSample& sample, const RegistrationModel& model,
                              const Eigen::Isometry3d& model_from_scan, const IcpOptions& options) {
  std::vector<Pair> pairs(sample.size());
  const Eigen::Matrix3f rotation = model_from_scan.linear().cast<float>();
  const auto min_cosine = static_cast<float>(std::cos(options.normal_limit_rad));
  ForEachBlock(sample.size(), kBlock, options.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f p = (model_from_scan * sample.points[i].cast<double>()).cast<float>();
      pairs[i] = {p, p, Eigen::Vector3f::Zero(), 0.0F, 0.0F};
      const auto hit = model.FindSurfaceRoughly(p);
      if (!hit) continue;
      const Eigen::Vector3f& normal = model.surface().Normal(hit->triangle);
      const bool agree = NormalsAgree(sample, i, rotation, normal, min_cosine);
      pairs[i] = {p, hit->foot, normal, hit->distance_mm, agree ? 1.0F : 0.0F};
    }
  });
  return pairs;
}

std::vector<Pair> PairWithSurface(const ScanSample& sample, const RegistrationModel& model,
                                  const Eigen::Isometry3d& model_from_scan, double reach_mm,
                                  const IcpOptions& options) {
  std::vector<Pair> pairs(sample.size());
  const Eigen::Matrix3f rotation = model_from_scan.linear().cast<float>();
  const auto min_cosine = static_cast<float>(std::cos(options.normal_limit_rad));
  const auto reach = static_cast<float>(reach_mm);
  ForEachBlock(sample.size(), kBlock, options.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f p = (model_from_scan * sample.points[i].cast<double>()).cast<float>();
      pairs[i] = {p, p, Eigen::Vector3f::Zero(), reach, 0.0F};
      const auto hit = model.FindSurface(p, reach);
      if (!hit) continue;
      const Eigen::Vector3f& normal = model.surface().Normal(hit->triangle);
      const bool agree = NormalsAgree(sample, i, rotation, normal, min_cosine);
      pairs[i] = {p, hit->foot, normal, hit->distance_mm, agree && !hit->on_rim ? 1.0F : 0.0F};
    }
  });
  return pairs;
}

std::vector<float> CappedDistances(const ScanSample& sample, const RegistrationModel& model,
                                   const Eigen::Isometry3d& model_from_scan, double cap_mm,
                                   unsigned threads) {
  std::vector<float> distances(sample.size());
  const auto cap = static_cast<float>(cap_mm);
  ForEachBlock(sample.size(), kBlock, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto hit =
          model.FindSurface((model_from_scan * sample.points[i].cast<double>()).cast<float>(), cap);
      distances[i] = hit ? hit->distance_mm : cap;
    }
  });
  return distances;
}

double AdaptiveThreshold(const std::vector<Pair>& pairs, double gate_mm, double floor_mm, double sigmas) {
  double sum = 0, squares = 0, count = 0;
  for (const Pair& pair : pairs) {
    if (!(pair.weight > 0) || pair.distance_mm > gate_mm) continue;
    const double d = pair.distance_mm;
    sum += d;
    squares += d * d;
    ++count;
  }
  if (count == 0) return floor_mm;
  const double mean = sum / count;
  const double sigma = std::sqrt(std::max(squares / count - mean * mean, 0.0));
  return std::max(floor_mm, std::min(gate_mm, mean + sigmas * sigma));
}

void WeighByDistance(std::vector<Pair>& pairs, double threshold_mm) {
  const auto scale = static_cast<float>(1 / threshold_mm);
  for (Pair& pair : pairs) {
    const float ratio = pair.distance_mm * scale;
    const float inside = std::max(0.0F, 1 - ratio * ratio);
    pair.weight = pair.weight > 0 ? inside * inside : 0.0F;
  }
}

WeighedPairs WeighBiweight(std::vector<Pair>& pairs, double threshold_mm, double least_cut_mm) {
  std::vector<float> residuals;
  for (Pair& pair : pairs) {
    if (pair.distance_mm > threshold_mm) pair.weight = 0;
    if (pair.weight > 0) residuals.push_back(std::abs(Residual(pair)));
  }
  const std::size_t within = residuals.size();
  const double scale_mm = std::max(kMadToSigma * MedianOf(residuals), kSmallestScaleMm);
  const double cut_mm = std::max(kBiweight * scale_mm, least_cut_mm);
  for (Pair& pair : pairs) {
    if (!(pair.weight > 0)) continue;
    const double ratio = Residual(pair) / cut_mm;
    const double inside = std::max(0.0, 1 - ratio * ratio);
    pair.weight = static_cast<float>(inside * inside);
  }
  return {within, cut_mm};
}

}  // namespace forgescan
