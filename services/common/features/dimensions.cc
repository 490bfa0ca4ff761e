#include "services/common/features/dimensions.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "services/common/features/cylinder_fit.h"
#include "services/common/features/plane_fit.h"

namespace forgescan {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kLeastEndFaceCosine = 0.9;  // to the datum axis, 26 degrees: above, it is no end face
constexpr double kLeastDatumBaseMm = 1;      // summed arms of the datum's axis points: below, one place

// A value with what it was made of; an Error instead becomes the reason of the result.
struct Measurement {
  double value_mm = 0;
  double uncertainty_mm = 0;
  FitQuality quality;  // summed over the faces; sigma_mm unused
};

struct Axis {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  FitQuality quality;
};

void Add(FitQuality& sum, const FitQuality& one) {
  sum.points += one.points;
  sum.rejected += one.rejected;
}

// Everything the dimensions share: the model, and the points of every named face.
class Evaluation {
 public:
  Evaluation(const ModelBundle& model, const DimensionOptions& options, const FacePoints& selected)
      : model_(model), options_(options) {
    for (std::size_t i = 0; i < selected.faces.size(); ++i) {
      points_[model.faces[selected.faces[i]].name] = {selected.faces[i], &selected.points[i]};
    }
  }

  Result<Measurement> Measure(const DimensionSpec& spec) const {
    switch (spec.type) {
      case DimensionType::kLength:
        return Length(spec);
      case DimensionType::kWidth:
        return Width(spec);
      case DimensionType::kDiameter:
        return Diameter(spec);
    }
    return Fail(ErrorCode::kInvalidArgument, "unknown type of dimension");
  }

 private:
  struct Owned {
    std::uint32_t face;
    const Points* points;
  };

  Result<Owned> Seen(const std::string& name) const {
    const Owned& owned = points_.at(name);
    if (owned.points->size() >= options_.min_points) return owned;
    return Fail(ErrorCode::kDegenerate, "face '{}' has {} measured points, at least {} are needed", name,
                owned.points->size(), options_.min_points);
  }

  Result<PlaneFit> Plane(const std::string& name) const {
    ASSIGN_OR_RETURN(const Owned owned, Seen(name));
    ASSIGN_OR_RETURN(PlaneFit plane, FitPlane(*owned.points, options_.fit));
    if (plane.normal.dot(model_.faces[owned.face].direction) < 0) plane.normal = -plane.normal;
    return plane;
  }

  // The faces are one cylinder. Below min_arc_deg the radius stays nominal, and the fit says so; a free fit
  // that fails although the arc is long enough fails for good, with its own sentence.
  Result<CylinderFit> Cylinder(const std::vector<std::string>& names) const {
    Points points;
    const ModelFace* nominal = nullptr;
    for (const std::string& name : names) {
      ASSIGN_OR_RETURN(const Owned owned, Seen(name));
      points.insert(points.end(), owned.points->begin(), owned.points->end());
      nominal = &model_.faces[owned.face];
    }
    CylinderStart start{nominal->point, nominal->direction, nominal->radius_mm};
    auto fit = FitCylinder(points, start, options_.fit);
    if (fit.ok() && fit->arc_deg >= options_.min_arc_deg) return fit;
    start.keep_radius = true;
    auto constrained = FitCylinder(points, start, options_.fit);
    if (fit.ok()) return constrained;
    return constrained.ok() && constrained->arc_deg < options_.min_arc_deg ? constrained : fit;
  }

  Result<Axis> DatumAxis(const std::vector<std::string>& names) const {
    Points centers;
    Axis axis;
    for (const std::string& name : names) {
      ASSIGN_OR_RETURN(const CylinderFit fit, Cylinder({name}));
      Add(axis.quality, fit.quality);
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

  Result<Measurement> Length(const DimensionSpec& spec) const {
    ASSIGN_OR_RETURN(const Axis axis, DatumAxis(spec.datum));
    Measurement result;
    Add(result.quality, axis.quality);
    std::array<double, 2> at{};
    double variance = 0;
    for (std::size_t i = 0; i < 2; ++i) {
      ASSIGN_OR_RETURN(const PlaneFit plane, Plane(spec.faces[i]));
      const double cosine = plane.normal.dot(axis.direction);
      if (std::abs(cosine) < kLeastEndFaceCosine) {
        return Fail(ErrorCode::kDegenerate, "face '{}' stands at {:.1f} degrees to the datum axis",
                    spec.faces[i], std::acos(std::min(std::abs(cosine), 1.0)) * kDegreesPerRadian);
      }
      at[i] = plane.normal.dot(plane.point - axis.point) / cosine;
      variance += std::pow(plane.OffsetUncertaintyMm(axis.point + at[i] * axis.direction) / cosine, 2);
      Add(result.quality, plane.quality);
    }
    result.value_mm = std::abs(at[0] - at[1]);
    result.uncertainty_mm = std::sqrt(variance);
    return result;
  }

  Result<Measurement> Width(const DimensionSpec& spec) const {
    ASSIGN_OR_RETURN(const PlaneFit first, Plane(spec.faces[0]));
    ASSIGN_OR_RETURN(const PlaneFit second, Plane(spec.faces[1]));
    const double angle_rad = std::asin(std::min(1.0, first.normal.cross(second.normal).norm()));
    if (angle_rad > options_.max_angle_rad) {
      return Fail(ErrorCode::kDegenerate,
                  "faces '{}' and '{}' are {:.5f} rad from parallel, at most {:.5f} are allowed",
                  spec.faces[0], spec.faces[1], angle_rad, options_.max_angle_rad);
    }
    Measurement result;
    // The second plane's point is the mean of its points.
    result.value_mm = std::abs(first.Residual(second.point));
    result.uncertainty_mm =
        std::hypot(first.OffsetUncertaintyMm(second.point), second.OffsetUncertaintyMm(second.point));
    Add(result.quality, first.quality);
    Add(result.quality, second.quality);
    return result;
  }

  Result<Measurement> Diameter(const DimensionSpec& spec) const {
    ASSIGN_OR_RETURN(const CylinderFit fit, Cylinder(spec.faces));
    if (fit.radius_constrained) {
      return Fail(ErrorCode::kDegenerate,
                  "radius constrained: the points cover an arc of {:.0f} degrees, at least {:.0f} "
                  "are needed",
                  fit.arc_deg, options_.min_arc_deg);
    }
    return Measurement{2 * fit.radius_mm, 2 * fit.RadiusUncertaintyMm(), fit.quality};
  }

  const ModelBundle& model_;
  const DimensionOptions& options_;
  std::map<std::string, Owned> points_;
};

DimensionResult Describe(const DimensionSpec& spec, const Result<Measurement>& measured,
                         double flag_removed_share) {
  DimensionResult result;
  result.name = spec.name;
  result.type = spec.type;
  result.nominal_mm = spec.nominal_mm;
  if (!measured.ok()) {
    result.reason = measured.error().message;
    return result;
  }
  result.measured_mm = measured->value_mm;
  result.standard_uncertainty_mm = measured->uncertainty_mm;
  result.points = measured->quality.used();
  result.removed_share = measured->quality.rejected_share();
  if (result.removed_share > flag_removed_share) {
    result.reason =
        fmt::format("{:.1f} % of the points were rejected as outliers", 100 * result.removed_share);
  }
  return result;
}

}  // namespace

Result<std::vector<DimensionResult>> EvaluateDimensions(const PointCloud& cloud_in_model,
                                                        const ModelBundle& model, const Features& features,
                                                        const DimensionOptions& options) {
  std::map<std::uint32_t, bool> named;
  for (const DimensionSpec& spec : features.dimensions) {
    for (const auto* names : {&spec.faces, &spec.datum}) {
      for (const std::string& name : *names) {
        ASSIGN_OR_RETURN(const std::uint32_t face, FindFace(model, name));
        named[face] = true;
      }
    }
  }
  std::vector<std::uint32_t> faces;
  for (const auto& [face, is_named] : named) faces.push_back(face);
  ASSIGN_OR_RETURN(const FacePoints selected, SelectFacePoints(cloud_in_model, model, faces, options.select));
  const Evaluation evaluation(model, options, selected);
  std::vector<DimensionResult> results;
  for (const DimensionSpec& spec : features.dimensions) {
    results.push_back(Describe(spec, evaluation.Measure(spec), options.flag_removed_share));
  }
  return results;
}

}  // namespace forgescan
