#include "services/reconstruction/projector_consistency.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

constexpr double kKeptFraction = 0.9;
constexpr int kIterations = 8;  // the fits below change by less than 1 % after five

// Numbers with mean 0 and rms 1, so that one tolerance of the solver fits all of them.
struct Normalised {
  Eigen::ArrayXd values;
  double scale;

  explicit Normalised(const Eigen::ArrayXd& raw) : values(raw - raw.mean()) {
    scale = std::max(std::sqrt(values.square().mean()), 1e-12 * (std::abs(raw.mean()) + 1e-300));
    values /= scale;
  }
};

// The size of the residual that nine tenths of the points stay below.
double KeptLimit(const Eigen::ArrayXd& residual) {
  std::vector<double> sizes(static_cast<std::size_t>(residual.size()));
  Eigen::Map<Eigen::ArrayXd>(sizes.data(), residual.size()) = residual.abs();
  const auto at = static_cast<std::ptrdiff_t>(kKeptFraction * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), sizes.begin() + at, sizes.end());
  return sizes[static_cast<std::size_t>(at)];
}

double KeptRms(const Eigen::ArrayXd& residual) {
  const double limit = KeptLimit(residual);
  const Eigen::ArrayXd kept = (residual.abs() <= limit).cast<double>();
  return std::sqrt((kept * residual.square()).sum() / kept.sum());
}

Eigen::VectorXd Solve(const Eigen::MatrixXd& columns, const Eigen::ArrayXd& wanted,
                      const Eigen::ArrayXd& weight) {
  constexpr double kFree = 1e-9;  // a flat scene leaves unknowns free: the least solution of all then
  const Eigen::MatrixXd weighted = weight.matrix().asDiagonal() * columns;
  return LeastNormSolution(weighted.transpose() * weighted, weighted.transpose() * (weight * wanted).matrix(),
                           kFree);
}

// u = (1, h) . a / (1 + h . b): the residuals of the best a and b.
Eigen::ArrayXd RationalResidual(const Eigen::MatrixXd& h, const Eigen::ArrayXd& u) {
  Eigen::MatrixXd columns(h.rows(), 1 + 2 * h.cols());
  columns << Eigen::VectorXd::Ones(h.rows()), h, u.matrix().asDiagonal() * -h;
  Eigen::ArrayXd weight = Eigen::ArrayXd::Ones(h.rows());
  Eigen::ArrayXd residual;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::VectorXd solution = Solve(columns, u, weight);
    const Eigen::ArrayXd denominator = 1 + (h * solution.tail(h.cols())).array();
    residual = u - (columns.leftCols(1 + h.cols()) * solution.head(1 + h.cols())).array() / denominator;
    weight = (residual.abs() <= KeptLimit(residual)).cast<double>() / denominator.abs().max(1e-3);
  }
  return residual;
}

// value = (1, h) . c: c.
Eigen::VectorXd AffineFit(const Eigen::MatrixXd& h, const Eigen::ArrayXd& value) {
  Eigen::MatrixXd columns(h.rows(), 1 + h.cols());
  columns << Eigen::VectorXd::Ones(h.rows()), h;
  Eigen::VectorXd solution;
  Eigen::ArrayXd weight = Eigen::ArrayXd::Ones(h.rows());
  for (int i = 0; i < kIterations; ++i) {
    solution = Solve(columns, value, weight);
    const Eigen::ArrayXd residual = value - (columns * solution).array();
    weight = (residual.abs() <= KeptLimit(residual)).cast<double>();
  }
  return solution;
}

}  // namespace

std::optional<ProjectorConsistency> MeasureProjectorConsistency(std::span<const LitPoint> points,
                                                                double baseline_mm) {
  if (points.size() < kMinLitPoints) {
    return std::nullopt;
  }
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::ArrayXXd raw(count, 4);  // x / z, y / z, 1 / z, column
  for (Eigen::Index i = 0; i < count; ++i) {
    const LitPoint& point = points[static_cast<std::size_t>(i)];
    const Eigen::Vector3d p = point.p_in_camera.cast<double>();
    raw.row(i) << p.x() / p.z(), p.y() / p.z(), 1 / p.z(), static_cast<double>(point.coordinate_px);
  }
  const Normalised x(raw.col(0)), y(raw.col(1)), w(raw.col(2)), u(raw.col(3));
  Eigen::MatrixXd h(count, 3);
  h << x.values.matrix(), y.values.matrix(), w.values.matrix();
  const Eigen::MatrixXd pixel = h.leftCols(2);
  const double px_per_tangent = AffineFit(pixel, u.values)(1) * u.scale / x.scale;
  const Eigen::VectorXd flat = AffineFit(pixel, w.values);
  const Eigen::ArrayXd relief_per_mm = w.scale * (w.values - flat(0) - (pixel * flat.tail(2)).array());
  return ProjectorConsistency{
      .column_rms_px = u.scale * KeptRms(RationalResidual(h, u.values)),
      .flat_column_rms_px = u.scale * KeptRms(RationalResidual(pixel, u.values)),
      .flat_parallax_px = std::abs(baseline_mm * px_per_tangent) * KeptRms(relief_per_mm)};
}

}  // namespace forgescan
