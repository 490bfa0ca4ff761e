// The design model in the shape registration needs it: a k-d tree of samples for the first steps, the exact
// surface for the last.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "services/common/geometry/triangle_index.h"
#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

// Nearest model sample of a query point.
struct NearestSample {
  std::uint32_t sample;
  float distance_mm;
};

// Source: section 2.2.2, step 2 (k-d tree of Q, resolution r). Built once per model, read-only afterwards:
// any number of threads may ask at the same time. Units: mm. Frames: model.
class RegistrationModel {
 public:
  // Errors: kInvalidArgument from Check(ModelBundle).
  static Result<RegistrationModel> Build(const ModelBundle& bundle);
  RegistrationModel(RegistrationModel&&) noexcept;
  RegistrationModel& operator=(RegistrationModel&&) noexcept;
  ~RegistrationModel();

  // Exact nearest samples (FLANN's single k-d tree, no approximation). The queries must be finite.
  std::vector<NearestSample> FindSamples(std::span<const Eigen::Vector3f> queries) const;

  const TriangleIndex& surface() const { return surface_; }
  const Eigen::Vector3f& SamplePoint(std::uint32_t i) const { return sample_points_[i]; }
  const Eigen::Vector3f& SampleNormal(std::uint32_t i) const { return sample_normals_[i]; }
  double spacing_mm() const { return spacing_mm_; }
  const Eigen::Vector3d& box_low() const { return box_low_; }
  const Eigen::Vector3d& box_high() const { return box_high_; }
  Eigen::Vector3d center() const { return 0.5 * (box_low_ + box_high_); }
  // Half of the bounding box's diagonal: a rotation of theta moves no model point more than theta times this.
  double reach_mm() const { return 0.5 * (box_high_ - box_low_).norm(); }

 private:
  struct Tree;
  RegistrationModel(TriangleIndex surface, const ModelBundle& bundle);

  TriangleIndex surface_;
  std::vector<Eigen::Vector3f> sample_points_, sample_normals_;
  std::unique_ptr<Tree> tree_;
  Eigen::Vector3d box_low_, box_high_;
  double spacing_mm_;
};

}  // namespace forgescan
