// The fitted faces of one part, from which its sizes are taken. Every face is fitted once.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "services/common/features/cylinder_fit.h"
#include "services/common/features/dimensions.h"
#include "services/common/features/plane_fit.h"

namespace forgescan {

// Where a length is measured along.
struct DatumAxis {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  FitQuality quality;  // points and rejected, over all cylinders
  std::string remark;  // which cylinders were held at their nominal axis; empty if none
};

// Points of a face, or of several that are one cylinder.
struct FaceCloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::uint16_t> views;  // empty where the cloud has none
};

// Names have been checked: every one is a face of the model, and among those selected.
class FaceFits {
 public:
  using Names = std::vector<std::string>;

  // All outlive the object. `ideal`: an even cover of the same faces by the model's own surface.
  FaceFits(const ModelBundle& model, const DimensionOptions& options, const FacePoints& seen,
           const FacePoints& ideal);

  // The face's plane; its normal is the outward one. Errors: FitPlane's; kDegenerate for too few points.
  Result<PlaneFit> Plane(const std::string& name) const;

  // The faces are one cylinder. Where it is seen over less than min_arc_deg the radius is held at the nominal
  // one (fit.radius_constrained) or, if options say so, the axis (fit.axis_constrained); a free fit that
  // fails although the arc is long enough fails for good. Errors: FitCylinder's; kDegenerate for too few
  // points.
  Result<CylinderFit> Cylinder(const Names& names) const;

  // The line through the axis points of the datum cylinders. Errors: Cylinder's; kDegenerate when they lie at
  // one place.
  Result<DatumAxis> Axis(const Names& names) const;

  // What was seen of the faces, and what an even cover would be. Errors: kDegenerate for too few points.
  Result<FaceCloud> Seen(const Names& names) const { return Gather(names, seen_, options_.min_points); }
  FaceCloud Ideal(const Names& names) const { return *Gather(names, ideal_, 0); }
  const ModelFace& Nominal(const std::string& name) const { return model_.faces[slots_.at(name).face]; }

 private:
  struct Slot {
    std::uint32_t face;  // of the model
    std::size_t index;   // of the selection
  };
  Result<FaceCloud> Gather(const Names& names, const FacePoints& from, std::size_t needed) const;
  Result<CylinderFit> FitFaces(const Names& names) const;

  const ModelBundle& model_;
  const DimensionOptions& options_;
  const FacePoints& seen_;
  const FacePoints& ideal_;
  std::map<std::string, Slot> slots_;
  mutable std::map<Names, Result<CylinderFit>> cylinders_;
};

}  // namespace forgescan
