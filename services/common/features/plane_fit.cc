#include "services/common/features/plane_fit.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "services/common/geometry/dense_solvers.h"

namespace forgescan {
namespace {

constexpr double kFlatShare =
    1e-6;  // second spread against the first (variances): below, the points are a line

Status CheckSpread(double smaller, double larger, std::size_t points) {
  if (smaller > kFlatShare * larger) return {};
  return Fail(ErrorCode::kDegenerate, "{} points lie on a line, a plane needs spread in two directions",
              points);
}

// A plane on its way to the least-squares one: w is its normal.
class PlaneModel {
 public:
  static constexpr int kUnknowns = PlaneSums::kUnknowns;
  static constexpr const char* kName = "plane";

  // The plane of the points' own spread.
  static Result<PlaneModel> Through(std::span<const Eigen::Vector3d> points) {
    PlaneModel plane;
    for (const Eigen::Vector3d& p : points) plane.frame_.origin += p;
    plane.frame_.origin /= static_cast<double>(points.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : points) {
      scatter += (p - plane.frame_.origin) * (p - plane.frame_.origin).transpose();
    }
    const auto [spread, axes] = EigensystemOf(scatter);
    RETURN_IF_ERROR(CheckSpread(spread[1], spread[2], points.size()));
    plane.frame_.axes << axes.col(2), axes.col(1), axes.col(0);
    plane.size_mm_ = std::sqrt(spread[2] / static_cast<double>(points.size()));
    return plane;
  }

  double SizeMm() const { return size_mm_; }
  NormalSums<3> Sum(std::span<const Eigen::Vector3d> points, double limit_mm) const {
    return SumRows(points, frame_, Shape(), limit_mm);
  }
  std::vector<float> Residuals(std::span<const Eigen::Vector3d> points) const {
    return AbsoluteResiduals(points, frame_, Shape());
  }

  // Through the centroid of the points used, turned by the slope of their residuals.
  Result<double> Move(const NormalSums<3>& sums) {
    if (sums.used < 3) return Fail(ErrorCode::kDegenerate, "fewer than 3 points are left for a plane");
    const auto count = static_cast<double>(sums.used);
    const Eigen::Vector2d mean = sums.normal.block<2, 1>(1, 0) / count;
    scatter_ = sums.normal.block<2, 2>(1, 1) - count * mean * mean.transpose();
    const Eigen::Vector2d spread = EigenvaluesOf(scatter_);
    RETURN_IF_ERROR(CheckSpread(spread[0], spread[1], sums.used));
    narrow_mm_ = std::sqrt(spread[0] / count) * size_mm_;
    const Eigen::Vector2d right = sums.right.tail<2>() - mean * sums.right[0];
    const Eigen::Vector2d turn = scatter_.inverse() * right;
    frame_.origin +=
        frame_.axes * Eigen::Vector3d(mean.x() * size_mm_, mean.y() * size_mm_, sums.right[0] / count);
    const Eigen::Vector3d normal =
        (frame_.axes * Eigen::Vector3d(-turn.x() / size_mm_, -turn.y() / size_mm_, 1)).normalized();
    const Eigen::Vector3d u = frame_.axes.col(1).cross(normal).normalized();
    frame_.axes << u, normal.cross(u), normal;
    return sums.right[0] * sums.right[0] / count + right.dot(turn);
  }

  PlaneFit Take(const FitQuality& quality) const {
    PlaneFit plane;
    plane.point = frame_.origin;
    plane.normal = frame_.axes.col(2);
    Eigen::Index largest = 0;
    plane.normal.cwiseAbs().maxCoeff(&largest);
    if (plane.normal[largest] < 0) plane.normal = -plane.normal;
    const Eigen::Matrix<double, 3, 2> across = frame_.axes.leftCols<2>() / size_mm_;
    plane.covariance = across * scatter_.inverse() * across.transpose();
    plane.spread_mm = narrow_mm_;
    plane.quality = quality;
    return plane;
  }

 private:
  PlaneSums Shape() const { return {1 / size_mm_}; }

  FitFrame frame_;
  double size_mm_ = 1;  // spread of the points the plane began with
  double narrow_mm_ = 0;
  Eigen::Matrix2d scatter_ = Eigen::Matrix2d::Identity();  // along u and v, in size_mm_^2
};

}  // namespace

double PlaneFit::OffsetUncertaintyMm(const Eigen::Vector3d& at) const {
  const Eigen::Vector3d arm = at - point;
  const double variance =
      1.0 / static_cast<double>(std::max<std::size_t>(quality.used(), 1)) + arm.dot(covariance * arm);
  return quality.sigma_mm * std::sqrt(variance);
}

Result<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points, const RobustOptions& options) {
  constexpr std::size_t kUnknowns = PlaneSums::kUnknowns;
  RETURN_IF_ERROR(CheckCount(points, std::max(kUnknowns, options.min_points), "plane"));
  auto model = PlaneModel::Through(EvenSample(points, kStartPoints));
  if (!model.ok()) {
    RETURN_IF_ERROR(CheckFinite(points));
    return model.error();
  }
  ASSIGN_OR_RETURN(const FitQuality quality, FitRobust(points, options, *model));
  const PlaneFit plane = model->Take(quality);
  RETURN_IF_ERROR(CheckForm(plane.quality, plane.spread_mm, options, "plane"));
  return plane;
}

}  // namespace forgescan
