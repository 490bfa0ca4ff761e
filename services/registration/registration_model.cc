#include "services/registration/registration_model.h"

#include <algorithm>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kSymmetryMm = 0.005;  // distance of a model from itself: rounding of its file

}  // namespace

RegistrationModel::RegistrationModel(TriangleIndex surface, const ModelBundle& bundle)
    : surface_(std::move(surface)),
      grid_(bundle.grid),
      sample_points_(bundle.sample_points),
      sample_normals_(bundle.sample_normals),
      spacing_mm_(bundle.spacing_mm),
      chord_error_mm_(bundle.chord_error_mm) {
  Eigen::AlignedBox3d box;
  std::vector<bool> taken(bundle.vertices.size(), false);
  for (const TriangleCorners& t : bundle.triangles) {
    for (const std::uint32_t v : t) {
      if (taken[v]) continue;
      taken[v] = true;
      box.extend(bundle.vertices[v].cast<double>());
      vertices_.push_back(bundle.vertices[v]);
    }
  }
  box_low_ = box.min();
  box_high_ = box.max();
}

Result<RegistrationModel> RegistrationModel::Build(const ModelBundle& bundle) {
  RETURN_IF_ERROR(Check(bundle));
  ASSIGN_OR_RETURN(TriangleIndex surface, TriangleIndex::Build(bundle.vertices, bundle.triangles));
  RegistrationModel model(std::move(surface), bundle);
  for (int axis = 0; axis < 3; ++axis) {
    model.symmetric_[static_cast<std::size_t>(axis)] = IsSymmetry(model, HalfTurn(model, axis));
  }
  return model;
}

double RegistrationModel::symmetry_limit_mm() const { return std::max(kSymmetryMm, 2 * chord_error_mm_); }

double CornerMotionMm(const Eigen::Isometry3d& motion, const RegistrationModel& model) {
  double worst = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto side = [corner](int axis) { return (corner >> axis & 1) != 0; };
    Eigen::Vector3d p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = (side(axis) ? model.box_high() : model.box_low())[axis];
    worst = std::max(worst, (motion * p - p).norm());
  }
  return worst;
}

Eigen::Isometry3d HalfTurn(const RegistrationModel& model, int axis) {
  const Eigen::Translation3d center(model.center());
  return center * Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::Unit(axis)) * center.inverse();
}

bool IsSymmetry(const RegistrationModel& model, const Eigen::Isometry3d& motion) {
  const auto limit_mm = static_cast<float>(model.symmetry_limit_mm());
  const auto on_surface = [&](const Eigen::Vector3f& p) {
    return model.FindSurface((motion * p.cast<double>()).cast<float>(), limit_mm).has_value();
  };
  return std::ranges::all_of(model.vertices(), on_surface) &&
         std::ranges::all_of(model.sample_points(), on_surface);
}

}  // namespace forgescan
