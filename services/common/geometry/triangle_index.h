// Exact nearest point on a triangle mesh, by a bounding volume hierarchy.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "services/common/geometry/triangle_mesh.h"
#include "services/common/result.h"

namespace forgescan {

using TriangleCorners = std::array<std::uint32_t, 3>;  // one entry of TriangleMesh::triangles

// Purpose: distances of measured points to the design surface itself, not to samples of it.
// Shape: any number of triangles >= 1; triangles need not be connected. Units: mm. Frames: that of the
// vertices. Precision: single precision about the mesh's centre, about 1e-4 mm over a 2 m part.
class TriangleIndex {
 public:
  // Faces that meet at a larger angle meet at a sharp edge; above what tessellation makes of curved faces.
  static constexpr double kSharpEdge_rad = 0.6;
  static constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();

  struct Nearest {
    std::uint32_t triangle;  // in the order given to Build
    float distance_mm;       // >= 0
    Eigen::Vector3f foot;    // nearest point of the mesh
    bool on_rim;             // the foot lies on a sharp edge, or where the mesh ends
  };

  // Errors: kInvalidArgument for no triangles, a vertex number out of range, or a vertex that is not finite.
  // Triangles without area stay in the index: their edges are still part of the surface.
  static Result<TriangleIndex> Build(const std::vector<Eigen::Vector3f>& vertices,
                                     const std::vector<TriangleCorners>& triangles);
  static Result<TriangleIndex> Build(const TriangleMesh& mesh) {
    return Build(mesh.vertices, mesh.triangles);
  }

  // The nearest point within max_distance_mm, or nothing (also for a point that is not finite). `hint` is a
  // triangle believed to be near, such as the previous point's: it speeds the search up and does not change
  // the distance.
  std::optional<Nearest> Find(const Eigen::Vector3f& point, float max_distance_mm,
                              std::uint32_t hint = kNoTriangle) const;

  // The nearest of the named triangles, with the rules of Find for what is equally near. The numbers must be
  // below size().
  std::optional<Nearest> FindAmong(const Eigen::Vector3f& point, float max_distance_mm,
                                   std::span<const std::uint32_t> triangles) const;

  struct Distance {
    std::uint32_t triangle;
    float distance_mm;
  };
  // Triangles within radius_mm, in the order of the tree; no more than `most`. Nothing for a point that is
  // not finite.
  std::vector<Distance> FindWithin(const Eigen::Vector3f& point, float radius_mm, std::size_t most) const;

  // Unit normal, outward by the corner order; zero for a triangle without area.
  const Eigen::Vector3f& Normal(std::uint32_t triangle) const { return corners_[slot_of_[triangle]].normal; }
  std::size_t size() const { return corners_.size(); }

 private:
  struct Corners {
    Eigen::Vector3f a, ab, ac, normal;
    std::uint32_t triangle;
    std::uint32_t rims;  // bits: the edge a-b, a-c, b-c is sharp or has no neighbour
  };
  struct Node {
    Eigen::Vector3f low;
    std::uint32_t
        first;  // leaf: first slot in corners_; inner: index of the right child (the left one follows)
    Eigen::Vector3f high;
    std::uint32_t count;  // triangles of a leaf, 0 for an inner node
  };
  struct Best;

  void BuildNode(std::size_t begin, std::size_t end, std::vector<Eigen::Vector3f>& centroids);
  void MarkRims(const std::vector<Eigen::Vector3f>& vertices, const std::vector<TriangleCorners>& triangles);
  bool IsOnRim(const Corners& corners, const Eigen::Vector3f& foot) const;
  static void Visit(const Corners& corners, std::uint32_t slot, const Eigen::Vector3f& point, Best& best);
  void VisitLeaf(const Node& leaf, const Eigen::Vector3f& point, Best& best) const;
  std::optional<Nearest> NearestOf(const Best& best, const Eigen::Vector3f& point) const;

  Eigen::Vector3f center_ = Eigen::Vector3f::Zero();
  std::vector<Corners> corners_;        // in leaf order
  std::vector<std::uint32_t> slot_of_;  // triangle -> position in corners_
  std::vector<Node> nodes_;
};

}  // namespace forgescan
