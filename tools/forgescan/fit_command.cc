#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "services/common/features/cone_fit.h"
#include "services/common/features/cylinder_fit.h"
#include "services/common/features/plane_fit.h"
#include "services/common/features/sphere_fit.h"
#include "services/common/geometry/cloud_io.h"
#include "services/common/output_file.h"
#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/output_files.h"

namespace forgescan {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Json = nlohmann::json;

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kAnyForm = 1e6;  // mm, and a share: nothing scatters more

struct Arguments {
  std::string shape, cloud, json;
  std::vector<double> near_mm;
  std::optional<double> radius_mm;
  RobustOptions fit;
};

Json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Status CheckNeighbourhood(const Arguments& arguments) {
  if (arguments.near_mm.empty() != !arguments.radius_mm) {
    return Fail(ErrorCode::kInvalidArgument, "--near and --radius go together, only one was given");
  }
  if (!arguments.radius_mm) return {};
  if (!(*arguments.radius_mm > 0) || !std::isfinite(*arguments.radius_mm)) {
    return Fail(ErrorCode::kInvalidArgument, "--radius is {} mm, it must be finite and > 0",
                *arguments.radius_mm);
  }
  const bool is_finite = std::all_of(arguments.near_mm.begin(), arguments.near_mm.end(),
                                     [](double value) { return std::isfinite(value); });
  if (is_finite && arguments.near_mm.size() == 3) return {};
  return Fail(ErrorCode::kInvalidArgument,
              "--near takes one place, three finite numbers x,y,z; {} were given", arguments.near_mm.size());
}

// The neighbourhood has passed its check; without one, all points.
Points TakePoints(const PointCloud& cloud, const Arguments& arguments) {
  Points points;
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3d point = p.cast<double>();
    if (arguments.radius_mm &&
        !((point - Eigen::Map<const Eigen::Vector3d>(arguments.near_mm.data())).norm() <=
          *arguments.radius_mm)) {
      continue;
    }
    points.push_back(point);
  }
  return points;
}

// What all shapes tell: form errors are upper bounds, they contain the noise of the points.
template <typename Shape>
Json Quality(const Points& points, const Shape& fit) {
  return {{"points", fit.quality.used()},
          {"rejected", fit.quality.rejected},
          {"sigma_mm", fit.quality.sigma_mm},
          {"form_range_mm", fit.quality.range_mm},
          {"form_d95_mm", ThinnestShellMm(points, fit)}};
}

Result<Json> FitAxial(const Arguments& arguments, const Points& points) {
  if (arguments.shape == "cylinder") {
    ASSIGN_OR_RETURN(const CylinderFit fit, FitCylinder(points, std::nullopt, arguments.fit));
    Json json = Quality(points, fit);
    json["axis_point_mm"] = Vector(fit.axis_point);
    json["axis"] = Vector(fit.axis);
    json["radius_mm"] = fit.radius_mm;
    json["axis_uncertainty_deg"] = fit.AxisUncertaintyRad() * kDegreesPerRadian;
    json["arc_deg"] = fit.arc_deg;
    json["radius_uncertainty_mm"] = fit.RadiusUncertaintyMm();
    return json;
  }
  // A cone is found from the cylinder that comes nearest, however badly it fits.
  RobustOptions any = arguments.fit;
  any.max_form_share = any.max_form_sigma_mm = kAnyForm;
  ASSIGN_OR_RETURN(const CylinderFit near, FitCylinder(points, std::nullopt, any));
  ASSIGN_OR_RETURN(const ConeFit fit,
                   FitCone(points, {near.axis_point, near.axis, near.radius_mm, 0}, arguments.fit));
  Json json = Quality(points, fit);
  json["axis_point_mm"] = Vector(fit.axis_point);
  json["axis"] = Vector(fit.axis);
  json["radius_mm"] = fit.radius_mm;
  json["radius_uncertainty_mm"] = fit.RadiusUncertaintyMm();
  json["half_angle_deg"] = fit.half_angle_rad * kDegreesPerRadian;
  json["half_angle_uncertainty_deg"] = fit.HalfAngleUncertaintyRad() * kDegreesPerRadian;
  return json;
}

Result<Json> FitShape(const Arguments& arguments, const Points& points) {
  Json json;
  if (arguments.shape == "plane") {
    ASSIGN_OR_RETURN(const PlaneFit fit, FitPlane(points, arguments.fit));
    json = Quality(points, fit);
    json["normal"] = Vector(fit.normal);
    json["offset_mm"] = fit.offset_mm();
    json["offset_uncertainty_mm"] = fit.OffsetUncertaintyMm(fit.point);
  } else if (arguments.shape == "sphere") {
    ASSIGN_OR_RETURN(const SphereFit fit, FitSphere(points, arguments.fit));
    json = Quality(points, fit);
    json["center_mm"] = Vector(fit.center);
    json["radius_mm"] = fit.radius_mm;
    json["radius_uncertainty_mm"] = std::sqrt(fit.covariance(3, 3));
  } else {
    return FitAxial(arguments, points);
  }
  return json;
}

Status Run(const Arguments& arguments) {
  ASSIGN_OR_RETURN(auto outputs, OutputFiles::Create({arguments.cloud}, {arguments.json}));
  RETURN_IF_ERROR(CheckNeighbourhood(arguments));
  ASSIGN_OR_RETURN(const CloudFromFile cloud, ReadPointCloud(arguments.cloud));
  ASSIGN_OR_RETURN(Json json, FitShape(arguments, TakePoints(cloud, arguments)));
  json["not_finite"] = cloud.not_finite;
  const std::string text = json.dump(2) + "\n";
  if (arguments.json.empty()) {
    std::fputs(text.c_str(), stdout);
    return {};
  }
  RETURN_IF_ERROR(WriteOutputFile(outputs.Staged(arguments.json), text));
  return outputs.Commit();
}

}  // namespace

void AddFitCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("fit", "Fit a plane, sphere, cylinder or cone to a cloud");
  command->add_option("shape", arguments->shape, "plane, sphere, cylinder or cone")
      ->required()
      ->check(CLI::IsMember({"plane", "sphere", "cylinder", "cone"}));
  command->add_option("--cloud", arguments->cloud, "points, PLY or PCD, mm")->required();
  command->add_option("--near", arguments->near_mm, "x,y,z: only points about this place, mm")
      ->delimiter(',')
      ->expected(1, CLI::detail::expected_max_vector_size);
  command->add_option("--radius", arguments->radius_mm, "of that neighbourhood, mm");
  command->add_option("--json", arguments->json, "where to write the result (default: standard output)");
  command->add_option("--reject-sigmas", arguments->fit.reject_sigmas, "points farther off are dropped")
      ->capture_default_str();
  command->add_option("--min-points", arguments->fit.min_points, "fewer used points are no fit")
      ->check(FiniteRange(1, 1e9))
      ->capture_default_str();
  command
      ->add_option("--max-form-share", arguments->fit.max_form_share,
                   "scatter against the radius, or the smaller spread of a plane; above, it is another shape")
      ->capture_default_str();
  command
      ->add_option("--max-form-sigma-mm", arguments->fit.max_form_sigma_mm,
                   "scatter of points of one shape, however large")
      ->capture_default_str();
  command->callback([arguments, &outcome] { outcome = Run(*arguments); });
}

}  // namespace forgescan
