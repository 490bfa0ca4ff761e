#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "services/common/features/cylinder_fit.h"
#include "services/common/features/plane_fit.h"
#include "services/common/features/sphere_fit.h"
#include "services/common/geometry/cloud_io.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/text_output.h"

namespace forgescan {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Json = nlohmann::json;

struct Arguments {
  std::string shape, cloud, json;
  std::vector<double> near_mm;
  double radius_mm = 0;
  RobustOptions fit;
};

Json Vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Result<Points> TakePoints(const Arguments& arguments) {
  ASSIGN_OR_RETURN(const PointCloud cloud, ReadPointCloud(arguments.cloud));
  if (arguments.near_mm.empty() != !(arguments.radius_mm > 0)) {
    return Fail(ErrorCode::kInvalidArgument, "--near and --radius (> 0 mm) go together");
  }
  Points points;
  for (const Eigen::Vector3f& p : cloud.points) {
    const Eigen::Vector3d point = p.cast<double>();
    if (!arguments.near_mm.empty() &&
        !((point - Eigen::Map<const Eigen::Vector3d>(arguments.near_mm.data())).norm() <=
          arguments.radius_mm)) {
      continue;
    }
    points.push_back(point);
  }
  return points;
}

Json Quality(const FitQuality& quality) {
  return {{"points", quality.used()}, {"rejected", quality.rejected}, {"sigma_mm", quality.sigma_mm}};
}

Result<Json> FitShape(const Arguments& arguments, const Points& points) {
  Json json;
  if (arguments.shape == "plane") {
    ASSIGN_OR_RETURN(const PlaneFit fit, FitPlane(points, arguments.fit));
    json = Quality(fit.quality);
    json["normal"] = Vector(fit.normal);
    json["offset_mm"] = fit.offset_mm();
    json["offset_uncertainty_mm"] = fit.OffsetUncertaintyMm(fit.point);
  } else if (arguments.shape == "sphere") {
    ASSIGN_OR_RETURN(const SphereFit fit, FitSphere(points, arguments.fit));
    json = Quality(fit.quality);
    json["center_mm"] = Vector(fit.center);
    json["radius_mm"] = fit.radius_mm;
    json["radius_uncertainty_mm"] = std::sqrt(fit.covariance(3, 3));
  } else {
    ASSIGN_OR_RETURN(const CylinderFit fit, FitCylinder(points, std::nullopt, arguments.fit));
    json = Quality(fit.quality);
    json["axis_point_mm"] = Vector(fit.axis_point);
    json["axis"] = Vector(fit.axis);
    json["radius_mm"] = fit.radius_mm;
    json["arc_deg"] = fit.arc_deg;
    json["radius_uncertainty_mm"] = fit.RadiusUncertaintyMm();
  }
  return json;
}

Status Run(const Arguments& arguments) {
  ASSIGN_OR_RETURN(const Points points, TakePoints(arguments));
  ASSIGN_OR_RETURN(const Json json, FitShape(arguments, points));
  const std::string text = json.dump(2) + "\n";
  if (!arguments.json.empty()) return WriteText(arguments.json, text);
  std::fputs(text.c_str(), stdout);
  return {};
}

}  // namespace

void AddFitCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("fit", "Fit a plane, sphere or cylinder to a cloud");
  command->add_option("shape", arguments->shape, "plane, sphere or cylinder")
      ->required()
      ->check(CLI::IsMember({"plane", "sphere", "cylinder"}));
  command->add_option("--cloud", arguments->cloud, "points, PLY or PCD, mm")->required();
  command->add_option("--near", arguments->near_mm, "x,y,z: only points about this place, mm")
      ->delimiter(',')
      ->expected(3);
  command->add_option("--radius", arguments->radius_mm, "of that neighbourhood, mm");
  command->add_option("--json", arguments->json, "where to write the result (default: standard output)");
  command->add_option("--reject-sigmas", arguments->fit.reject_sigmas, "points farther off are dropped")
      ->capture_default_str();
  command->callback([arguments, &outcome] { outcome = Run(*arguments); });
}

}  // namespace forgescan
