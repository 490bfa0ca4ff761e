#include "services/common/features/robust_fit.h"

#include <algorithm>

namespace forgescan {
namespace {

constexpr double kMadToSigma = 1.4826;  // for normal residuals
constexpr double kRoundingMm = 1e-6;    // keeps exact data from losing points to the last digit

}  // namespace

double RejectionLimit(std::vector<double>& absolute_residuals, double reject_sigmas) {
  if (absolute_residuals.empty()) return kRoundingMm;
  const auto middle = absolute_residuals.begin() + static_cast<std::ptrdiff_t>(absolute_residuals.size() / 2);
  std::nth_element(absolute_residuals.begin(), middle, absolute_residuals.end());
  return reject_sigmas * kMadToSigma * *middle + kRoundingMm;
}

Status CheckPoints(std::span<const Eigen::Vector3d> points, std::size_t needed, const char* feature) {
  if (points.size() < needed) {
    return Fail(ErrorCode::kInvalidArgument, "{} points, a {} needs at least {}", points.size(), feature,
                needed);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) return Fail(ErrorCode::kInvalidArgument, "point {} is not finite", i);
  }
  return {};
}

}  // namespace forgescan
