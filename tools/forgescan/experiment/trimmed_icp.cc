#include "tools/forgescan/experiment/trimmed_icp.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace forgescan {
namespace {

// Indices of the nearest pairs; of equals the earlier one.
std::vector<std::size_t> NearestPairs(const std::vector<NearestSample>& pairs, double share) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&pairs](std::size_t a, std::size_t b) {
    return pairs[a].distance_mm < pairs[b].distance_mm;
  });
  order.resize(static_cast<std::size_t>(share * static_cast<double>(order.size())));
  return order;
}

}  // namespace

TrimmedIcpResult AlignTrimmed(const std::vector<Eigen::Vector3f>& scan, const RegistrationModel& model,
                              const Eigen::Isometry3d& start, const TrimmedIcpOptions& options) {
  const std::size_t stride = std::max<std::size_t>(1, scan.size() / options.points);
  TrimmedIcpResult result{start, 0, 0};
  double last_square = std::numeric_limits<double>::infinity();
  while (result.iterations < options.max_iterations) {
    std::vector<Eigen::Vector3f> moved;
    for (std::size_t i = 0; i < scan.size(); i += stride) {
      moved.push_back((result.model_from_scan * scan[i].cast<double>()).cast<float>());
    }
    const std::vector<NearestSample> pairs = model.FindSamples(moved);
    const std::vector<std::size_t> kept = NearestPairs(pairs, options.overlap_share);
    Eigen::Matrix3Xd from(3, kept.size()), to(3, kept.size());
    double square = 0;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i);
      from.col(column) = moved[kept[i]].cast<double>();
      to.col(column) = model.SamplePoint(pairs[kept[i]].sample).cast<double>();
      square += (from.col(column) - to.col(column)).squaredNorm() / static_cast<double>(kept.size());
    }
    const Eigen::Isometry3d step(Eigen::umeyama(from, to, false));
    result.model_from_scan = step * result.model_from_scan;
    result.rms_mm = std::sqrt(square);
    ++result.iterations;
    if (std::abs(last_square - square) <= options.stop_share * square) break;
    last_square = square;
  }
  return result;
}

}  // namespace forgescan
