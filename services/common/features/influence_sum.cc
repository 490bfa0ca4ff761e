#include "services/common/features/influence_sum.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

constexpr double kFewInCell = 5;  // points: with fewer the mean of a cell says nothing of its form

// Pieces of form do not lie as the cells do. A cell of a piece's size, laid anywhere over independent pieces,
// overlaps four: its mean varies with 2/3 of their variance along each direction (a smooth form with a
// Gaussian correlation of the same area: 0.68). The rest is within the cells.
constexpr double kSeenInMeans = 4.0 / 9;

using Key = std::array<int, 2>;

Key CellOf(const Eigen::Vector2d& place, double size_mm) {
  return {static_cast<int>(std::floor(place.x() / size_mm)),
          static_cast<int>(std::floor(place.y() / size_mm))};
}

std::uint16_t ViewOf(const WeighedPoints& seen, std::size_t i) {
  return seen.views.empty() ? std::uint16_t{0} : seen.views[i];
}

Vector5 CylinderRow(const Eigen::Vector3d& normal, double along, const Eigen::Matrix<double, 3, 2>& across) {
  const Eigen::Vector2d unit = across.transpose() * normal;
  Vector5 row;
  row << unit, along * unit, 1;
  return row;
}

struct Cell {
  double weight = 0, ideal = 0;
  double count = 0, sum = 0, squares = 0;  // of the residuals of the points used
};

// Variance of a piece of form, and of one point within a cell. Units: mm^2.
struct Scatter {
  double form = 0, noise = 0;
};

// Where hardly more cells have enough points than the fit has unknowns, nothing tells form from noise: all
// that is left of the points counts as both.
Scatter ScatterOf(const std::map<Key, Cell>& cells, double unknowns) {
  double points = 0, within = 0, used = 0, all_points = 0, all_squares = 0;
  for (const auto& [key, cell] : cells) {
    all_points += cell.count;
    all_squares += cell.squares;
    if (cell.count < kFewInCell) continue;
    used += 1;
    points += cell.count;
    within += cell.squares - cell.sum * cell.sum / cell.count;
  }
  if (used <= unknowns) {
    const double all = all_squares / std::max(1.0, all_points - unknowns);
    return {all, all};
  }
  const double noise = std::max(0.0, within / std::max(1.0, points - used));
  double between = 0;
  for (const auto& [key, cell] : cells) {
    if (cell.count < kFewInCell) continue;
    const double mean = cell.sum / cell.count;
    between += mean * mean - noise / cell.count;
  }
  // The fit itself took `unknowns` of what the cells could differ by.
  return {std::max(0.0, between / (used - unknowns)) / kSeenInMeans, noise};
}

}  // namespace

WeighedPoints WeighDiameter(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                            double limit_mm) {
  WeighedPoints result;
  result.points = points;
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = cylinder.axis.unitOrthogonal();
  across.col(1) = cylinder.axis.cross(across.col(0));
  std::vector<Vector5> rows;
  Matrix5 normal = Matrix5::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d q = p - cylinder.axis_point;
    const double along = q.dot(cylinder.axis);
    const Eigen::Vector3d radial = q - along * cylinder.axis;
    result.normals.push_back(radial.normalized());
    result.residuals.push_back(radial.norm() - cylinder.radius_mm);
    const double turn = std::atan2(across.col(1).dot(radial), across.col(0).dot(radial));
    result.places.emplace_back(along, turn * cylinder.radius_mm);
    // Tilts times the radius, so that the five unknowns are mm.
    rows.push_back(std::abs(result.residuals.back()) <= limit_mm
                       ? CylinderRow(result.normals.back(), along / cylinder.radius_mm, across)
                       : Vector5::Zero().eval());
    normal += rows.back() * rows.back().transpose();
  }
  Vector5 of_diameter;
  if (cylinder.axis_constrained) {
    of_diameter << 0, 0, 0, 0, 2 / normal(4, 4);
  } else {
    of_diameter = 2 * InverseOf(normal).col(4);
  }
  for (const Vector5& row : rows) result.weights.push_back(of_diameter.dot(row));
  return result;
}

WeighedPoints WeighHeight(std::span<const Eigen::Vector3d> points, const PlaneFit& plane,
                          const Eigen::Vector3d& at, double limit_mm, double factor) {
  WeighedPoints result;
  result.points = points;
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = plane.normal.unitOrthogonal();
  across.col(1) = plane.normal.cross(across.col(0));
  std::vector<Eigen::Vector3d> rows;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d arm = across.transpose() * (p - plane.point);
    result.residuals.push_back(plane.Residual(p));
    result.places.push_back(arm);
    const bool is_used = std::abs(result.residuals.back()) <= limit_mm;
    rows.push_back(is_used ? Eigen::Vector3d(1, arm.x(), arm.y()) : Eigen::Vector3d::Zero());
    normal += rows.back() * rows.back().transpose();
  }
  const Eigen::Vector2d arm = across.transpose() * (at - plane.point);
  const Eigen::Vector3d of_height = factor * normal.inverse() * Eigen::Vector3d(1, arm.x(), arm.y());
  for (const Eigen::Vector3d& row : rows) result.weights.push_back(of_height.dot(row));
  result.normals.assign(points.size(), plane.normal);
  return result;
}

void InfluenceSum::Add(const WeighedPoints& seen, const WeighedPoints& ideal, double unknowns) {
  AddViews(seen);
  AddPatches(seen);
  AddForm(seen, ideal, unknowns);
}

void InfluenceSum::Add(const WeighedPoints& seen, double noise_mm2) {
  AddViews(seen);
  AddPatches(seen);
  AddNoise(seen, noise_mm2);
}

void InfluenceSum::AddViews(const WeighedPoints& seen) {
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    const std::uint16_t view = ViewOf(seen, i);
    ViewInfluence& sum = views_[view];
    sum.view = view;
    const Eigen::Vector3d middle = view < middles_.size() ? middles_[view] : Eigen::Vector3d::Zero();
    const Eigen::Vector3d push = seen.weights[i] * seen.normals[i];
    const Eigen::Vector3d arm = seen.points[i] - middle;
    outward_ += seen.weights[i];
    sum.shift += push;
    sum.turn_mm += arm.cross(push);
    sum.scale_mm += push.dot(arm);
    sum.stretch_mm += push.dot(seen.points[i]);
  }
}

void InfluenceSum::AddPatches(const WeighedPoints& seen) {
  std::map<std::pair<std::uint16_t, Key>, double> patches;
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    patches[{ViewOf(seen, i), CellOf(seen.places[i], options_.patch_cell_mm)}] += seen.weights[i];
  }
  for (const auto& [key, weight] : patches) patch2_ += weight * weight;
}

void InfluenceSum::AddNoise(const WeighedPoints& seen, double noise_mm2) {
  for (const double weight : seen.weights) noise_mm2_ += noise_mm2 * weight * weight;
}

void InfluenceSum::AddForm(const WeighedPoints& seen, const WeighedPoints& ideal, double unknowns) {
  std::map<Key, Cell> cells;
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    if (seen.weights[i] == 0) continue;
    Cell& cell = cells[CellOf(seen.places[i], options_.form_cell_mm)];
    cell.weight += seen.weights[i];
    cell.count += 1;
    cell.sum += seen.residuals[i];
    cell.squares += seen.residuals[i] * seen.residuals[i];
  }
  const Scatter scatter = ScatterOf(cells, unknowns);
  AddNoise(seen, scatter.noise);
  for (std::size_t i = 0; i < ideal.points.size(); ++i) {
    cells[CellOf(ideal.places[i], options_.form_cell_mm)].ideal += ideal.weights[i];
  }
  for (const auto& [key, cell] : cells) {
    form_mm2_ += scatter.form * (cell.weight - cell.ideal) * (cell.weight - cell.ideal);
  }
}

Influence InfluenceSum::Take() const {
  Influence influence;
  for (const auto& [view, sum] : views_) influence.views.push_back(sum);
  influence.outward = outward_;
  influence.noise_mm = std::sqrt(noise_mm2_);
  influence.form_mm = std::sqrt(form_mm2_);
  influence.patch = std::sqrt(patch2_);
  return influence;
}

std::vector<Eigen::Vector3d> ViewMiddles(std::span<const Eigen::Vector3f> points,
                                         std::span<const std::uint16_t> views) {
  std::vector<Eigen::Vector3d> sums(1, Eigen::Vector3d::Zero());
  std::vector<double> counts(1, 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t view = views.empty() ? 0 : views[i];
    if (view >= sums.size()) {
      sums.resize(view + 1, Eigen::Vector3d::Zero());
      counts.resize(view + 1, 0);
    }
    if (!points[i].allFinite()) continue;
    sums[view] += points[i].cast<double>();
    counts[view] += 1;
  }
  for (std::size_t view = 0; view < sums.size(); ++view) sums[view] /= std::max(1.0, counts[view]);
  return sums;
}

}  // namespace forgescan
