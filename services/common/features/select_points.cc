#include "services/common/features/select_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "services/common/parallel_blocks.h"

namespace forgescan {
namespace {

constexpr std::size_t kBlock = 2048;
constexpr std::uint32_t kNotAsked = std::numeric_limits<std::uint32_t>::max();

// The edges of a face that only one of its triangles has, as triangles without area; nothing for a closed
// face.
Result<std::optional<TriangleIndex>> BorderOf(const ModelBundle& model, const ModelFace& face) {
  std::map<std::array<std::uint32_t, 2>, int> uses;
  for (std::uint32_t i = face.first_triangle; i < face.first_triangle + face.triangle_count; ++i) {
    const TriangleCorners& t = model.triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (a != b) ++uses[{std::min(a, b), std::max(a, b)}];
    }
  }
  std::vector<TriangleCorners> edges;
  for (const auto& [edge, count] : uses) {
    if (count == 1) edges.push_back({edge[0], edge[1], edge[1]});
  }
  if (edges.empty()) return std::optional<TriangleIndex>();
  ASSIGN_OR_RETURN(TriangleIndex index, TriangleIndex::Build(model.vertices, edges));
  return std::optional<TriangleIndex>(std::move(index));
}

Status CheckShape(const PointCloud& cloud) {
  if (!cloud.normals.empty() && cloud.normals.size() != cloud.size()) {
    return Fail(ErrorCode::kInvalidArgument, "the cloud has {} points but {} normals", cloud.size(),
                cloud.normals.size());
  }
  if (cloud.view.empty() || cloud.view.size() == cloud.size()) return {};
  return Fail(ErrorCode::kInvalidArgument, "the cloud has {} points but {} view numbers", cloud.size(),
              cloud.view.size());
}

}  // namespace

Result<FaceSelector> FaceSelector::Build(const ModelBundle& model, const std::vector<std::uint32_t>& faces) {
  RETURN_IF_ERROR(Check(model));
  ASSIGN_OR_RETURN(TriangleIndex surface, TriangleIndex::Build(model.vertices, model.triangles));
  FaceSelector selector(std::move(surface), faces);
  std::vector<std::uint32_t> slot_of_face(model.faces.size(), kNotAsked);
  for (const std::uint32_t face : faces) {
    if (face >= model.faces.size()) {
      return Fail(ErrorCode::kInvalidArgument, "face {} of a model with {}", face, model.faces.size());
    }
    slot_of_face[face] = static_cast<std::uint32_t>(selector.borders_.size());
    ASSIGN_OR_RETURN(auto border, BorderOf(model, model.faces[face]));
    selector.borders_.push_back(std::move(border));
  }
  selector.slot_of_triangle_ = FaceOfTriangles(model);
  for (std::uint32_t& entry : selector.slot_of_triangle_) entry = slot_of_face[entry];
  return selector;
}

// Slot of the face that owns the point, or kNotAsked.
std::uint32_t FaceSelector::SlotOf(const PointCloud& cloud, std::size_t i, const SelectOptions& options,
                                   std::uint32_t& hint) const {
  const auto hit = surface_.Find(cloud.points[i], static_cast<float>(options.max_distance_mm), hint);
  if (!hit) return kNotAsked;
  hint = hit->triangle;
  const std::uint32_t slot = slot_of_triangle_[hit->triangle];
  if (slot == kNotAsked) return kNotAsked;
  if (!cloud.normals.empty()) {
    const Eigen::Vector3f& measured = cloud.normals[i];
    const auto min_cosine = static_cast<float>(std::cos(options.normal_limit_rad));
    if (!(measured.dot(surface_.Normal(hit->triangle)) >= min_cosine * measured.norm())) return kNotAsked;
  }
  const auto& border = borders_[slot];
  return border && border->Find(hit->foot, static_cast<float>(options.border_mm)) ? kNotAsked : slot;
}

Result<FacePoints> FaceSelector::Select(const PointCloud& cloud_in_model,
                                        const SelectOptions& options) const {
  RETURN_IF_ERROR(CheckShape(cloud_in_model));
  std::vector<std::uint32_t> slots(cloud_in_model.size(), kNotAsked);
  ForEachBlock(slots.size(), kBlock, options.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::uint32_t hint = TriangleIndex::kNoTriangle;
    for (std::size_t i = begin; i < end; ++i) slots[i] = SlotOf(cloud_in_model, i, options, hint);
  });
  FacePoints result{faces_, std::vector<std::vector<Eigen::Vector3d>>(faces_.size()), {}};
  if (!cloud_in_model.view.empty()) result.views.resize(faces_.size());
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (slots[i] == kNotAsked) continue;
    result.points[slots[i]].push_back(cloud_in_model.points[i].cast<double>());
    if (!result.views.empty()) result.views[slots[i]].push_back(cloud_in_model.view[i]);
  }
  return result;
}

}  // namespace forgescan
