#include "services/registration/registration_model.h"

#include <algorithm>

namespace forgescan {

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
  return RegistrationModel(std::move(surface), bundle);
}

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

}  // namespace forgescan
