#include "services/common/features/face_fits.h"

#include <Eigen/Geometry>

namespace forgescan {
namespace {

constexpr double kLeastDatumBaseMm = 1;  // summed arms of the datum's axis points: below, one place

void Add(FitQuality& sum, const FitQuality& one) {
  sum.points += one.points;
  sum.rejected += one.rejected;
}

}  // namespace

FaceFits::FaceFits(const ModelBundle& model, const DimensionOptions& options, const FacePoints& seen,
                   const FacePoints& ideal)
    : model_(model), options_(options), seen_(seen), ideal_(ideal) {
  for (std::size_t i = 0; i < seen.faces.size(); ++i) {
    slots_[model.faces[seen.faces[i]].name] = {seen.faces[i], i};
  }
}

Result<FaceCloud> FaceFits::Gather(const Names& names, const FacePoints& from, std::size_t needed) const {
  FaceCloud cloud;
  for (const std::string& name : names) {
    const std::size_t index = slots_.at(name).index;
    const std::vector<Eigen::Vector3d>& points = from.points[index];
    if (points.size() < needed) {
      return Fail(ErrorCode::kDegenerate, "face '{}' has {} measured points, at least {} are needed", name,
                  points.size(), needed);
    }
    cloud.points.insert(cloud.points.end(), points.begin(), points.end());
    if (from.views.empty()) continue;
    cloud.views.insert(cloud.views.end(), from.views[index].begin(), from.views[index].end());
  }
  return cloud;
}

Result<PlaneFit> FaceFits::Plane(const std::string& name) const {
  ASSIGN_OR_RETURN(const FaceCloud cloud, Seen({name}));
  ASSIGN_OR_RETURN(PlaneFit plane, FitPlane(cloud.points, options_.fit));
  if (plane.normal.dot(Nominal(name).direction) < 0) plane.normal = -plane.normal;
  return plane;
}

Result<CylinderFit> FaceFits::Cylinder(const Names& names) const {
  const auto known = cylinders_.find(names);
  if (known != cylinders_.end()) return known->second;
  return cylinders_.emplace(names, FitFaces(names)).first->second;
}

Result<CylinderFit> FaceFits::FitFaces(const Names& names) const {
  ASSIGN_OR_RETURN(const FaceCloud cloud, Seen(names));
  const ModelFace& nominal = Nominal(names.back());
  CylinderStart start{nominal.point, nominal.direction, nominal.radius_mm};
  auto fit = FitCylinder(cloud.points, start, options_.fit);
  if (fit.ok() && fit->arc_deg >= options_.min_arc_deg) return fit;
  (options_.short_arc == ShortArc::kHoldAxis ? start.keep_axis : start.keep_radius) = true;
  auto constrained = FitCylinder(cloud.points, start, options_.fit);
  if (fit.ok()) return constrained;
  return constrained.ok() && constrained->arc_deg < options_.min_arc_deg ? constrained : fit;
}

Result<DatumAxis> FaceFits::Axis(const Names& names) const {
  std::vector<Eigen::Vector3d> centers;
  DatumAxis axis;
  for (const std::string& name : names) {
    ASSIGN_OR_RETURN(const CylinderFit fit, Cylinder({name}));
    Add(axis.quality, fit.quality);
    if (fit.axis_constrained) {
      axis.remark += fmt::format(
          "{}datum '{}' is held at its nominal axis, as the points cover an arc of {:.0f} degrees, at least "
          "{:.0f} are needed",
          axis.remark.empty() ? "" : "; ", name, fit.arc_deg, options_.min_arc_deg);
    }
    centers.push_back(fit.axis_point);
    axis.point = fit.axis_point;
    axis.direction = fit.axis;
  }
  if (centers.size() < 2) return axis;
  // The line through the axis points is far better fixed than the direction of any short cylinder.
  axis.point = Eigen::Vector3d::Zero();
  for (const auto& c : centers) axis.point += c / static_cast<double>(centers.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& c : centers) {
    const Eigen::Vector3d arm = c - axis.point;
    sum += arm.dot(centers.front() - axis.point) < 0 ? -arm : arm;
  }
  if (sum.norm() < kLeastDatumBaseMm)
    return Fail(ErrorCode::kDegenerate, "the datum cylinders lie at one place, they give no axis");
  axis.direction = sum.normalized();
  return axis;
}

}  // namespace forgescan
