#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/common/features/deviation_surface.h"

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Triangle {
  Eigen::Vector3f a, b, c, centroid;
  std::uint32_t number;
};

Status CheckMesh(const std::vector<Eigen::Vector3f>& vertices,
                 const std::vector<TriangleCorners>& triangles) {
  if (triangles.empty()) {
    return Fail(ErrorCode::kInvalidArgument, "the surface has no triangles, at least 1 is needed");
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!vertices[i].allFinite()) return Fail(ErrorCode::kInvalidArgument, "vertex {} is not finite", i);
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (*std::max_element(triangles[i].begin(), triangles[i].end()) >= vertices.size()) {
      return Fail(ErrorCode::kInvalidArgument, "triangle {} names a vertex beyond the {} there are", i,
                  vertices.size());
    }
  }
  return {};
}

float InverseSquare(const Eigen::Vector3d& side) {
  const double squared = side.squaredNorm();
  return squared > 0 ? static_cast<float>(1 / squared) : 0;
}

}  // namespace

class DeviationSurface::Builder {
 public:
  Builder(const std::vector<Eigen::Vector3f>& vertices, const std::vector<TriangleCorners>& triangles) {
    triangles_.reserve(triangles.size());
    for (const TriangleCorners& t : triangles) {
      const Eigen::Vector3f &a = vertices[t[0]], &b = vertices[t[1]], &c = vertices[t[2]];
      triangles_.push_back({a, b, c, (a + b + c) / 3, static_cast<std::uint32_t>(triangles_.size())});
    }
  }

  DeviationSurface Build() {
    Add({0, triangles_.size()});
    surface_.grid_ = surface_.MakeGrid();
    return std::move(surface_);
  }

 private:
  static std::size_t Size(const Range& range) { return range.end - range.begin; }

  // Halves the range with the most triangles, until there are eight or none needs to be halved.
  std::vector<Range> Split(const Range& whole) {
    std::vector<Range> parts{whole};
    while (parts.size() < kWidth) {
      const auto largest = std::max_element(parts.begin(), parts.end(),
                                            [](const Range& x, const Range& y) { return Size(x) < Size(y); });
      if (Size(*largest) <= kWidth) break;
      const std::size_t middle = Halve(*largest);
      const Range second{middle, largest->end};
      largest->end = middle;
      parts.insert(largest + 1, second);
    }
    return parts;
  }

  // At the median of the longest axis, so that the first half fills its leaves.
  std::size_t Halve(const Range& range) {
    Eigen::AlignedBox3f spread;
    for (std::size_t i = range.begin; i < range.end; ++i) spread.extend(triangles_[i].centroid);
    Eigen::Index axis = 0;
    spread.sizes().maxCoeff(&axis);
    const std::size_t leaves = (Size(range) + kWidth - 1) / kWidth;
    const std::size_t middle = range.begin + leaves / 2 * kWidth;
    const auto at = [&](std::size_t i) { return triangles_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(range.begin), at(middle), at(range.end), [&](const Triangle& x, const Triangle& y) {
      const float cx = x.centroid[axis], cy = y.centroid[axis];
      return cx < cy || (cx == cy && x.number < y.number);
    });
    return middle;
  }

  std::int32_t AddLeaf(const Range& range) {
    Leaf leaf{};
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      if (lane < Size(range)) {
        Place(triangles_[range.begin + lane], lane, leaf);
        continue;
      }
      for (int i = 0; i < 3; ++i) leaf.corner[i][lane] = kFarAway_mm;
      for (int i = 0; i < 3; ++i) leaf.to_b[i][lane] = leaf.to_c[i][lane] = kNan;
    }
    surface_.leaves_.push_back(leaf);
    return ~static_cast<std::int32_t>(surface_.leaves_.size() - 1);
  }

  static void Place(const Triangle& t, std::size_t lane, Leaf& leaf) {
    const Eigen::Vector3d ab = (t.b - t.a).cast<double>(), ac = (t.c - t.a).cast<double>();
    const Eigen::Vector3d cross = ab.cross(ac);
    const double squared = cross.squaredNorm();
    // Shares of ab and ac of a place in the plane: its areas against the two sides over that of the triangle.
    const Eigen::Vector3d to_b = ac.cross(cross) / squared, to_c = cross.cross(ab) / squared;
    for (int i = 0; i < 3; ++i) {
      leaf.corner[i][lane] = t.a[i];
      leaf.ab[i][lane] = static_cast<float>(ab[i]);
      leaf.ac[i][lane] = static_cast<float>(ac[i]);
      leaf.normal[i][lane] = squared > 0 ? static_cast<float>(cross[i] / std::sqrt(squared)) : 0;
      leaf.to_b[i][lane] = squared > 0 ? static_cast<float>(to_b[i]) : kNan;
      leaf.to_c[i][lane] = squared > 0 ? static_cast<float>(to_c[i]) : kNan;
    }
    leaf.inverse_ab[lane] = InverseSquare(ab);
    leaf.inverse_ac[lane] = InverseSquare(ac);
    leaf.inverse_bc[lane] = InverseSquare(ac - ab);
  }

  Eigen::AlignedBox3f BoxOf(const Range& range) const {
    Eigen::AlignedBox3f box;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      box.extend(triangles_[i].a).extend(triangles_[i].b).extend(triangles_[i].c);
    }
    return box;
  }

  // A node for the range. Depth: every level divides by four at least, so it stays below 16.
  std::int32_t Add(const Range& range) {
    const std::size_t self = surface_.nodes_.size();
    surface_.nodes_.emplace_back();
    const std::vector<Range> parts = Split(range);
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      Eigen::AlignedBox3f box(Eigen::Vector3f::Constant(kFarAway_mm), Eigen::Vector3f::Constant(kFarAway_mm));
      std::int32_t child = 0;
      if (lane < parts.size()) {
        box = BoxOf(parts[lane]);
        child = Size(parts[lane]) <= kWidth ? AddLeaf(parts[lane]) : Add(parts[lane]);
      }
      Node& node = surface_.nodes_[self];
      node.child[lane] = child;
      for (int i = 0; i < 3; ++i) {
        node.low[i][lane] = box.min()[i];
        node.high[i][lane] = box.max()[i];
      }
    }
    return static_cast<std::int32_t>(self);
  }

  std::vector<Triangle> triangles_;
  DeviationSurface surface_;
};

Result<DeviationSurface> DeviationSurface::Build(const std::vector<Eigen::Vector3f>& vertices,
                                                 const std::vector<TriangleCorners>& triangles) {
  RETURN_IF_ERROR(CheckMesh(vertices, triangles));
  return Builder(vertices, triangles).Build();
}

}  // namespace forgescan
