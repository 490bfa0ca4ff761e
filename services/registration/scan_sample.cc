#include "services/registration/scan_sample.h"

#include <algorithm>

#include "services/common/parallel_blocks.h"

namespace forgescan {
namespace {

constexpr std::size_t kBlock = 16'384;
constexpr std::size_t kScatter = 2'654'435'761;  // Knuth's multiplier: 2^32 times the golden section

}  // namespace

std::vector<std::uint32_t> FindInBox(const PointCloud& scan, const RegistrationModel& model,
                                     const Eigen::Isometry3d& start, double margin_mm, unsigned threads) {
  const Eigen::Isometry3f motion = start.cast<float>();
  const Eigen::Vector3f center = model.center().cast<float>();
  const Eigen::Vector3f half = (0.5 * (model.box_high() - model.box_low()).array() + margin_mm).cast<float>();
  std::vector<std::vector<std::uint32_t>> found(BlockCount(scan.size(), kBlock));
  ForEachBlock(scan.size(), kBlock, threads, [&](std::size_t block, std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& inside = found[block];
    inside.resize(end - begin);
    std::size_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f off = motion.linear() * scan.points[i] + (motion.translation() - center);
      inside[count] = static_cast<std::uint32_t>(i);
      // A coordinate that is NaN fails the comparison.
      const auto is_within = [&](int axis) { return std::size_t{std::abs(off[axis]) <= half[axis]}; };
      count += is_within(0) & is_within(1) & is_within(2);
    }
    inside.resize(count);
  });
  std::vector<std::uint32_t> indices;
  for (const auto& block : found) indices.insert(indices.end(), block.begin(), block.end());
  return indices;
}

ScanSample TakeSample(const PointCloud& scan, const std::vector<std::uint32_t>& indices,
                      std::size_t max_points) {
  const std::size_t step = std::max<std::size_t>(1, (indices.size() + max_points - 1) / max_points);
  ScanSample sample;
  sample.points.reserve(indices.size() / step + 1);
  if (!scan.normals.empty()) sample.normals.reserve(indices.size() / step + 1);
  for (std::size_t first = 0; first < indices.size(); first += step) {
    // Anywhere within the step, so that a scan with an order of its own is not sampled by it.
    const std::size_t at = first + first / step * kScatter % step;
    if (at >= indices.size()) break;
    const std::uint32_t i = indices[at];
    if (!scan.normals.empty()) {
      const float length = scan.normals[i].norm();
      if (!(length > 0)) continue;
      sample.normals.emplace_back(scan.normals[i] / length);
    }
    sample.points.push_back(scan.points[i]);
  }
  return sample;
}

}  // namespace forgescan
