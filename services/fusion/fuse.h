// Fusion: the clouds of all views of a part as one cloud, in the array frame, at one temperature.
#pragma once

#include <span>

#include "services/common/geometry/point_cloud.h"
#include "services/fusion/expansion.h"
#include "services/fusion/view_matrices.h"

namespace forgescan {

struct ViewCloud {
  int view = 0;
  double temperature_degc = 0.0;  // of the part while the view was taken
  PointCloud cloud_in_camera;
  // The robot's error at this visit (visit_error.h); identity where nothing tells it.
  Eigen::Isometry3d taught_from_actual = Eigen::Isometry3d::Identity();
};

struct FuseOptions {
  double reference_degc = 900.0;  // temperature the sizes are given for
  Eigen::Vector3d fixed_in_array_mm =
      Eigen::Vector3d::Zero();  // point of the part that does not move when it shrinks
};

struct FusedCloud {
  PointCloud
      cloud_in_array;  // views in ascending order, points in the order of their view; sizes at reference_degc
  std::vector<double> scales;  // applied to each of the views, in the order they were given
};

// A part cools by about 1 K/s, so views taken seconds apart show it at different sizes: each is scaled about
// the fixed point to the reference temperature after it was moved into the array frame. Source: paper 2.1.3;
// hot sizes: EN 1993-1-2 form of eps(T), docs/design.md. Cost: one pass, memory-bound. Errors:
// kInvalidArgument (a view without matrix, a temperature outside the expansion table).
Result<FusedCloud> FuseViews(std::span<const ViewCloud> views, const ViewMatrices& matrices,
                             const ExpansionCurve& curve, const FuseOptions& options);

}  // namespace forgescan
