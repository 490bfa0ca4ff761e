#include "tools/forgescan/experiment/trimmed_icp.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace forgescan {
namespace {

struct SurfacePair {
  Eigen::Vector3d point, foot;
  float distance_mm;
};

// Each point with the nearest one of the surface. hints: the triangles of the step before, which are near.
std::vector<SurfacePair> PairAll(const std::vector<Eigen::Vector3d>& scan, const TriangleIndex& surface,
                                 const Eigen::Isometry3d& model_from_scan,
                                 std::vector<std::uint32_t>& hints) {
  std::vector<SurfacePair> pairs;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Eigen::Vector3d point = model_from_scan * scan[i];
    const auto nearest = surface.Find(point.cast<float>(), std::numeric_limits<float>::max(), hints[i]);
    if (!nearest) continue;  // a point that is not finite
    hints[i] = nearest->triangle;
    pairs.push_back({point, nearest->foot.cast<double>(), nearest->distance_mm});
  }
  return pairs;
}

struct Step {
  Eigen::Isometry3d moved_from_before;
  double mean_square = 0;
};

// The rigid motion between the nearest share of the pairs; of equally near ones the earlier.
Step MoveNearest(std::vector<SurfacePair> pairs, double share) {
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const SurfacePair& a, const SurfacePair& b) { return a.distance_mm < b.distance_mm; });
  const auto kept = static_cast<Eigen::Index>(share * static_cast<double>(pairs.size()));
  Eigen::Matrix3Xd from(3, kept), to(3, kept);
  for (Eigen::Index i = 0; i < kept; ++i) {
    from.col(i) = pairs[static_cast<std::size_t>(i)].point;
    to.col(i) = pairs[static_cast<std::size_t>(i)].foot;
  }
  const double square = (from - to).squaredNorm() / static_cast<double>(kept);
  return {Eigen::Isometry3d(Eigen::umeyama(from, to, false)), square};
}

}  // namespace

TrimmedIcpResult AlignTrimmed(const std::vector<Eigen::Vector3f>& scan, const TriangleIndex& surface,
                              const Eigen::Isometry3d& start, const TrimmedIcpOptions& options) {
  const std::size_t stride = std::max<std::size_t>(1, scan.size() / options.points);
  std::vector<Eigen::Vector3d> sample;
  for (std::size_t i = 0; i < scan.size(); i += stride) sample.push_back(scan[i].cast<double>());
  std::vector<std::uint32_t> hints(sample.size(), TriangleIndex::kNoTriangle);
  TrimmedIcpResult result{start, 0, 0};
  double last_square = std::numeric_limits<double>::infinity();
  while (result.iterations < options.max_iterations) {
    const Step step =
        MoveNearest(PairAll(sample, surface, result.model_from_scan, hints), options.overlap_share);
    result.model_from_scan = step.moved_from_before * result.model_from_scan;
    result.rms_mm = std::sqrt(step.mean_square);
    ++result.iterations;
    if (std::abs(last_square - step.mean_square) <= options.stop_share * step.mean_square) break;
    last_square = step.mean_square;
  }
  return result;
}

}  // namespace forgescan
