#include "services/common/model/surface_sampling.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace forgescan {
namespace {

// Steps of the two-dimensional additive sequence built on the real root of x^3 = x + 1 (Roberts 2018, "R2").
constexpr double kStepU = 0.7548776662466927;
constexpr double kStepV = 0.5698402909980532;

Eigen::Vector3d AreaVector(const ModelBundle& bundle, const TriangleCorners& t) {
  const Eigen::Vector3d a = bundle.vertices[t[0]].cast<double>();
  const Eigen::Vector3d ab = bundle.vertices[t[1]].cast<double>() - a;
  const Eigen::Vector3d ac = bundle.vertices[t[2]].cast<double>() - a;
  return 0.5 * ab.cross(ac);
}

Eigen::Vector3f PointInTriangle(const ModelBundle& bundle, const TriangleCorners& t, std::size_t number) {
  const double n = static_cast<double>(number) + 0.5;
  double u = n * kStepU - std::floor(n * kStepU);
  double v = n * kStepV - std::floor(n * kStepV);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  const Eigen::Vector3d a = bundle.vertices[t[0]].cast<double>();
  const Eigen::Vector3d b = bundle.vertices[t[1]].cast<double>();
  const Eigen::Vector3d c = bundle.vertices[t[2]].cast<double>();
  return (a + u * (b - a) + v * (c - a)).cast<float>();
}

// Points sorted by the cell of a regular grid, to look into neighbouring cells without a hash table.
class CellGrid {
 public:
  CellGrid(const std::vector<Eigen::Vector3f>& points, double cell_mm) : points_(points), cell_mm_(cell_mm) {
    for (const auto& p : points) box_.extend(p.cast<double>());
    for (std::uint32_t i = 0; i < points.size(); ++i) entries_.push_back({Key(Cell(points[i])), i});
    std::sort(entries_.begin(), entries_.end());
  }

  double NearestOther(std::uint32_t self) const {
    float best = std::numeric_limits<float>::infinity();
    const Eigen::Array3i cell = Cell(points_[self]);
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        VisitColumn(cell + Eigen::Array3i(dx, dy, 0), self, best);
      }
    }
    return std::sqrt(best);
  }

 private:
  using Entry = std::pair<std::uint64_t, std::uint32_t>;

  Eigen::Array3i Cell(const Eigen::Vector3f& p) const {
    return ((p.cast<double>() - box_.min()) / cell_mm_).array().floor().cast<int>() + 1;
  }
  static std::uint64_t Key(const Eigen::Array3i& c) {
    return static_cast<std::uint64_t>(c[0]) << 42 | static_cast<std::uint64_t>(c[1]) << 21 |
           static_cast<std::uint64_t>(c[2]);
  }
  // The cells z-1, z, z+1 of a column have consecutive keys.
  void VisitColumn(const Eigen::Array3i& cell, std::uint32_t self, float& best) const {
    const std::uint64_t key = Key(cell);
    for (auto it = std::lower_bound(entries_.begin(), entries_.end(), Entry{key - 1, 0});
         it != entries_.end() && it->first <= key + 1; ++it) {
      if (it->second != self) best = std::min(best, (points_[it->second] - points_[self]).squaredNorm());
    }
  }

  const std::vector<Eigen::Vector3f>& points_;
  double cell_mm_;
  Eigen::AlignedBox3d box_;
  std::vector<Entry> entries_;
};

}  // namespace

double MeanNearestDistance(const std::vector<Eigen::Vector3f>& points, double spacing_mm) {
  const CellGrid grid(points, 2 * spacing_mm);
  double sum = 0;
  std::size_t counted = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const double distance = grid.NearestOther(i);
    if (!std::isfinite(distance)) continue;
    sum += distance;
    ++counted;
  }
  return counted > 0 ? sum / static_cast<double>(counted) : 0;
}

Result<ModelBundle> SampleSurface(ModelBundle bundle, double spacing_mm) {
  if (!(spacing_mm > 0) || !std::isfinite(spacing_mm)) {
    return Fail(ErrorCode::kInvalidArgument, "the sample spacing is {} mm, expected > 0", spacing_mm);
  }
  double area = 0;
  for (const auto& t : bundle.triangles) area += AreaVector(bundle, t).norm();
  const double wanted = area / (spacing_mm * spacing_mm);
  if (!(wanted >= 1) || wanted > static_cast<double>(kMaxSamples)) {
    return Fail(ErrorCode::kInvalidArgument,
                "a surface of {:.6g} mm2 at {} mm spacing takes {:.3g} samples, allowed 1 to {}", area,
                spacing_mm, wanted, kMaxSamples);
  }
  bundle.sample_points.clear();
  bundle.sample_normals.clear();
  double walked = 0;  // area of the triangles passed so far, in samples
  for (const auto& t : bundle.triangles) {
    const Eigen::Vector3d area_vector = AreaVector(bundle, t);
    walked += area_vector.norm() / (spacing_mm * spacing_mm);
    while (static_cast<double>(bundle.sample_points.size()) + 0.5 < walked) {
      bundle.sample_points.push_back(PointInTriangle(bundle, t, bundle.sample_points.size()));
      bundle.sample_normals.emplace_back(area_vector.normalized().cast<float>());
    }
  }
  bundle.spacing_mm = spacing_mm;
  bundle.resolution_mm = MeanNearestDistance(bundle.sample_points, spacing_mm);
  return bundle;
}

}  // namespace forgescan
