// The design model in the shape registration needs it: its surface, with the bundle's grid for the search.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "services/common/geometry/surface_grid.h"
#include "services/common/geometry/triangle_index.h"
#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

// Built once per model, read-only afterwards: any number of threads may ask at the same time. Units: mm.
// Frames: model.
class RegistrationModel {
 public:
  // Errors: kInvalidArgument from Check(ModelBundle).
  static Result<RegistrationModel> Build(const ModelBundle& bundle);

  const TriangleIndex& surface() const { return surface_; }
  // As TriangleIndex::Find, by the grid.
  std::optional<TriangleIndex::Nearest> FindSurface(const Eigen::Vector3f& point,
                                                    float max_distance_mm) const {
    return grid_.Find(surface_, point, max_distance_mm);
  }
  // See SurfaceGrid::FindRoughly.
  std::optional<TriangleIndex::Nearest> FindSurfaceRoughly(const Eigen::Vector3f& point) const {
    return grid_.FindRoughly(surface_, point);
  }

  // Evenly spread over the surface, about one per spacing_mm^2; the paper's point cloud Q.
  const std::vector<Eigen::Vector3f>& sample_points() const { return sample_points_; }
  const std::vector<Eigen::Vector3f>& sample_normals() const { return sample_normals_; }
  // The corners of the triangles, each once.
  const std::vector<Eigen::Vector3f>& vertices() const { return vertices_; }
  double spacing_mm() const { return spacing_mm_; }
  double chord_error_mm() const { return chord_error_mm_; }  // see ModelBundle
  // How far the model may lie from itself: each of its two tessellations may be off by the chord error.
  double symmetry_limit_mm() const;
  // Whether a half turn about model axis 0, 1 or 2 through the box's centre maps the model onto itself.
  bool IsSymmetricAbout(int axis) const { return symmetric_[static_cast<std::size_t>(axis)]; }
  const Eigen::Vector3d& box_low() const { return box_low_; }
  const Eigen::Vector3d& box_high() const { return box_high_; }
  Eigen::Vector3d center() const { return 0.5 * (box_low_ + box_high_); }
  // Half of the bounding box's diagonal: a rotation of theta moves no model point more than theta times this.
  double reach_mm() const { return 0.5 * (box_high_ - box_low_).norm(); }

 private:
  RegistrationModel(TriangleIndex surface, const ModelBundle& bundle);

  TriangleIndex surface_;
  SurfaceGrid grid_;
  std::vector<Eigen::Vector3f> sample_points_, sample_normals_, vertices_;
  Eigen::Vector3d box_low_, box_high_;
  double spacing_mm_;
  double chord_error_mm_;
  std::array<bool, 3> symmetric_{};
};

// Farthest that a corner of the model's box moves. Units: mm. Frames: model.
double CornerMotionMm(const Eigen::Isometry3d& motion, const RegistrationModel& model);

// A half turn about model axis 0, 1 or 2 through the box's centre.
Eigen::Isometry3d HalfTurn(const RegistrationModel& model, int axis);
// Whether the motion maps the model onto itself: every vertex and every sample of it, to the precision of its
// triangles. One groove is enough for a no.
bool IsSymmetry(const RegistrationModel& model, const Eigen::Isometry3d& motion);

}  // namespace forgescan
