#include "services/registration/classify.h"

#include <cmath>

#include "services/common/parallel_blocks.h"

namespace forgescan {
namespace {

constexpr std::size_t kBlock = 4096;

}  // namespace

std::vector<std::uint32_t> FindPartPoints(const PointCloud& scan, const RegistrationModel& model,
                                          const Eigen::Isometry3d& model_from_scan,
                                          const ClassifyOptions& options) {
  const Eigen::Isometry3f motion = model_from_scan.cast<float>();
  const bool has_normals = scan.normals.size() == scan.size();
  const auto min_cosine = static_cast<float>(std::cos(options.normal_limit_rad));
  std::vector<std::vector<std::uint32_t>> kept(BlockCount(scan.size(), kBlock));
  ForEachBlock(
      scan.size(), kBlock, options.threads, [&](std::size_t block, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const auto hit =
              model.FindSurface(motion * scan.points[i], static_cast<float>(options.max_distance_mm));
          if (!hit) continue;
          const Eigen::Vector3f& normal = model.surface().Normal(hit->triangle);
          if (has_normals) {
            const Eigen::Vector3f measured = motion.linear() * scan.normals[i];
            if (!(measured.dot(normal) >= min_cosine * measured.norm())) continue;
          }
          kept[block].push_back(static_cast<std::uint32_t>(i));
        }
      });
  std::vector<std::uint32_t> indices;
  for (const auto& part : kept) indices.insert(indices.end(), part.begin(), part.end());
  return indices;
}

}  // namespace forgescan
