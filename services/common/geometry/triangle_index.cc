#include "services/common/geometry/triangle_index.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "services/common/geometry/nearest_on_triangle.h"

namespace forgescan {
namespace {

constexpr std::size_t kLeafSize = 4;
// Two triangles that share the nearest edge give distances that differ by rounding only.
constexpr float kTie = 1e-5F;
constexpr float kOnEdge_mm = 1e-3F;  // ten times the rounding over a 2 m part

float SquaredDistanceToBox(const Eigen::Vector3f& p, const Eigen::Vector3f& low,
                           const Eigen::Vector3f& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0F).squaredNorm();
}

}  // namespace

struct TriangleIndex::Best {
  float squared;  // nothing at or beyond this distance is of interest
  std::uint32_t slot = kNoTriangle;
  Eigen::Vector3f foot = Eigen::Vector3f::Zero();
  float off_plane =
      -1;  // |component of (point - foot) along the normal|: decides between triangles that share an edge
};

Result<TriangleIndex> TriangleIndex::Build(const std::vector<Eigen::Vector3f>& vertices,
                                           const std::vector<TriangleCorners>& triangles) {
  if (triangles.empty()) {
    return Fail(ErrorCode::kInvalidArgument, "the mesh has no triangles, at least 1 is needed");
  }
  TriangleIndex index;
  Eigen::AlignedBox3f box;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!vertices[i].allFinite()) return Fail(ErrorCode::kInvalidArgument, "mesh vertex {} is not finite", i);
    box.extend(vertices[i]);
  }
  if (!box.isEmpty()) index.center_ = box.center();
  std::vector<Eigen::Vector3f> centroids;
  centroids.reserve(triangles.size());
  index.corners_.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = triangles[i];
    if (std::max({t[0], t[1], t[2]}) >= vertices.size()) {
      return Fail(ErrorCode::kInvalidArgument, "mesh triangle {} names a vertex beyond the {} there are", i,
                  vertices.size());
    }
    const Eigen::Vector3f a = vertices[t[0]] - index.center_;
    const Eigen::Vector3f ab = vertices[t[1]] - vertices[t[0]], ac = vertices[t[2]] - vertices[t[0]];
    const Eigen::Vector3d normal = ab.cast<double>().cross(ac.cast<double>());
    const Eigen::Vector3d unit = normal.norm() > 0 ? normal.normalized().eval() : normal;
    index.corners_.push_back({a, ab, ac, unit.cast<float>(), static_cast<std::uint32_t>(i), 0});
    centroids.emplace_back(a + (ab + ac) / 3.0F);
  }
  index.MarkRims(vertices, triangles);
  index.nodes_.reserve(triangles.size());
  index.BuildNode(0, triangles.size(), centroids);
  index.slot_of_.resize(triangles.size());
  for (std::uint32_t slot = 0; slot < index.corners_.size(); ++slot) {
    index.slot_of_[index.corners_[slot].triangle] = slot;
  }
  return index;
}

// Neighbours are found by the places of their corners: STL files do not share vertices.
void TriangleIndex::MarkRims(const std::vector<Eigen::Vector3f>& vertices,
                             const std::vector<TriangleCorners>& triangles) {
  using Place = std::array<float, 3>;
  struct Side {
    Place from, to;
    std::uint32_t slot, bit;
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  const auto place = [&](std::uint32_t vertex) {
    return Place{vertices[vertex].x(), vertices[vertex].y(), vertices[vertex].z()};
  };
  for (std::uint32_t slot = 0; slot < triangles.size(); ++slot) {
    const TriangleCorners& t = triangles[slot];
    for (const auto& [i, j, bit] : {std::array{0U, 1U, 1U}, {0U, 2U, 2U}, {1U, 2U, 4U}}) {
      const auto [from, to] = std::minmax({place(t[i]), place(t[j])});
      sides.push_back({from, to, slot, bit});
    }
  }
  const auto key = [](const Side& side) { return std::tie(side.from, side.to, side.slot); };
  std::sort(sides.begin(), sides.end(), [&](const Side& x, const Side& y) { return key(x) < key(y); });
  const auto min_cosine = static_cast<float>(std::cos(kSharpEdge_rad));
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].from == sides[begin].from && sides[end].to == sides[begin].to)
      ++end;
    const bool smooth = end - begin == 2 && corners_[sides[begin].slot].normal.dot(
                                                corners_[sides[begin + 1].slot].normal) > min_cosine;
    for (std::size_t i = begin; i < end && !smooth; ++i) corners_[sides[i].slot].rims |= sides[i].bit;
  }
}

bool TriangleIndex::IsOnRim(const Corners& c, const Eigen::Vector3f& foot) const {
  const auto near = [&](std::uint32_t bit, const Eigen::Vector3f& start, const Eigen::Vector3f& side) {
    if ((c.rims & bit) == 0) return false;
    const Eigen::Vector3f arm = foot - start;
    const float along = std::clamp(arm.dot(side) / std::max(side.squaredNorm(), 1e-30F), 0.0F, 1.0F);
    return (arm - along * side).norm() <= kOnEdge_mm;
  };
  return near(1, c.a, c.ab) || near(2, c.a, c.ac) || near(4, c.a + c.ab, c.ac - c.ab);
}

// Splits at the median centroid of the longest axis: depth stays below 2 + log2(n), so recursion is bounded.
void TriangleIndex::BuildNode(std::size_t begin, std::size_t end, std::vector<Eigen::Vector3f>& centroids) {
  Eigen::AlignedBox3f box, spread;
  for (std::size_t i = begin; i < end; ++i) {
    const Corners& c = corners_[i];
    box.extend(c.a).extend(c.a + c.ab).extend(c.a + c.ac);
    spread.extend(centroids[c.triangle]);
  }
  const std::size_t self = nodes_.size();
  nodes_.push_back(
      {box.min(), static_cast<std::uint32_t>(begin), box.max(), static_cast<std::uint32_t>(end - begin)});
  if (end - begin <= kLeafSize) return;
  Eigen::Index axis = 0;
  spread.sizes().maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return corners_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](const Corners& x, const Corners& y) {
    const float cx = centroids[x.triangle][axis], cy = centroids[y.triangle][axis];
    return cx < cy || (cx == cy && x.triangle < y.triangle);
  });
  BuildNode(begin, middle, centroids);
  nodes_[self].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[self].count = 0;
  BuildNode(middle, end, centroids);
}

void TriangleIndex::Visit(const Corners& c, std::uint32_t slot, const Eigen::Vector3f& point, Best& best) {
  const Eigen::Vector3f foot = NearestOnTriangle(point, c.a, c.ab, c.ac, c.normal);
  const float squared = (point - foot).squaredNorm();
  if (!(squared <= best.squared * (1 + kTie))) return;  // also when a sliver gave NaN
  const float off_plane = std::abs(c.normal.dot(point - foot));
  const bool tie = best.slot != kNoTriangle && squared > best.squared * (1 - kTie);
  if (tie && off_plane <= best.off_plane) return;
  best = {std::min(squared, best.squared), slot, foot, off_plane};
}

void TriangleIndex::VisitLeaf(const Node& leaf, const Eigen::Vector3f& point, Best& best) const {
  for (std::uint32_t slot = leaf.first; slot < leaf.first + leaf.count; ++slot) {
    Visit(corners_[slot], slot, point, best);
  }
}

std::optional<TriangleIndex::Nearest> TriangleIndex::NearestOf(const Best& best,
                                                               const Eigen::Vector3f& point) const {
  if (best.slot == kNoTriangle) return std::nullopt;
  const Corners& hit = corners_[best.slot];
  return Nearest{hit.triangle, (point - best.foot).norm(), best.foot + center_, IsOnRim(hit, best.foot)};
}

std::optional<TriangleIndex::Nearest> TriangleIndex::FindAmong(
    const Eigen::Vector3f& point, float max_distance_mm, std::span<const std::uint32_t> triangles) const {
  const Eigen::Vector3f p = point - center_;
  if (!p.allFinite() || !(max_distance_mm >= 0)) return std::nullopt;
  Best best{max_distance_mm * max_distance_mm};
  for (const std::uint32_t triangle : triangles) {
    const std::uint32_t slot = slot_of_[triangle];
    Visit(corners_[slot], slot, p, best);
  }
  return NearestOf(best, p);
}

std::vector<TriangleIndex::Distance> TriangleIndex::FindWithin(const Eigen::Vector3f& point, float radius_mm,
                                                               std::size_t most) const {
  const Eigen::Vector3f p = point - center_;
  std::vector<Distance> found;
  if (!p.allFinite() || !(radius_mm >= 0)) return found;
  std::vector<std::uint32_t> stack = {0};
  while (!stack.empty() && found.size() < most) {
    const std::uint32_t at = stack.back();
    const Node& node = nodes_[at];
    stack.pop_back();
    if (SquaredDistanceToBox(p, node.low, node.high) > radius_mm * radius_mm) continue;
    if (node.count == 0) stack.insert(stack.end(), {node.first, at + 1});
    for (std::uint32_t slot = node.first; slot < node.first + node.count && found.size() < most; ++slot) {
      const Corners& c = corners_[slot];
      const float distance_mm = (p - NearestOnTriangle(p, c.a, c.ab, c.ac, c.normal)).norm();
      if (distance_mm <= radius_mm) found.push_back({c.triangle, distance_mm});
    }
  }
  return found;
}

std::optional<TriangleIndex::Nearest> TriangleIndex::Find(const Eigen::Vector3f& point, float max_distance_mm,
                                                          std::uint32_t hint) const {
  const Eigen::Vector3f p = point - center_;
  if (!p.allFinite() || !(max_distance_mm >= 0)) return std::nullopt;
  Best best{max_distance_mm * max_distance_mm};
  if (hint < slot_of_.size()) {
    const Corners& c = corners_[slot_of_[hint]];
    const float bound = (p - NearestOnTriangle(p, c.a, c.ab, c.ac, c.normal)).squaredNorm();
    best.squared = std::min(best.squared, bound * (1 + kTie));
  }
  struct Entry {
    std::uint32_t node;
    float squared;
  };
  std::array<Entry, 64> stack;  // a median tree over at most 2^32 triangles is less than 40 deep
  std::size_t depth = 0;
  stack[depth++] = {0, SquaredDistanceToBox(p, nodes_[0].low, nodes_[0].high)};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.squared > best.squared * (1 + kTie)) continue;
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      VisitLeaf(node, p, best);
      continue;
    }
    Entry near{entry.node + 1,
               SquaredDistanceToBox(p, nodes_[entry.node + 1].low, nodes_[entry.node + 1].high)};
    Entry far{node.first, SquaredDistanceToBox(p, nodes_[node.first].low, nodes_[node.first].high)};
    if (far.squared < near.squared) std::swap(near, far);
    stack[depth++] = far;
    stack[depth++] = near;
  }
  return NearestOf(best, p);
}

}  // namespace forgescan
