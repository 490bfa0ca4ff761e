// What a projector nobody calibrated says about a view: its columns are planes in space.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

namespace forgescan {

struct LitPoint {
  Eigen::Vector3f p_in_camera;  // mm
  float coordinate_px;          // projector column that lit it
};

// Each rms is of the best nine tenths of the points.
struct ProjectorConsistency {
  double column_rms_px = 0;       // columns against the best projector: u = (a.X + a4) / (b.X + b4)
  double flat_column_rms_px = 0;  // columns against a projective function of the left image alone
  double flat_parallax_px = 0;    // disparities against a plane's, rms in projector px
};

// Points of a correct calibration satisfy the first model up to noise and the distortion of the projector's
// lens, whatever the scene. A flat board satisfies the second one as well, be its depths right or wrong, for
// a projector in the left camera would explain them. But where the projector sees no relief the cameras must
// see none: flat_parallax_px over flat_column_rms_px is about the cameras' baseline over the projector's.
// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed., chapter 7 (resection), one row of the
// camera matrix; solved as a linear problem in (x, y, 1, 1/z) about the centre of the points, with the
// denominator as weight (Sanathanan and Koerner). Frames: the rectified left camera, all z positive.
// baseline_mm: its sign does not matter. nullopt for fewer than kMinLitPoints points.
constexpr std::size_t kMinLitPoints = 100;
std::optional<ProjectorConsistency> MeasureProjectorConsistency(std::span<const LitPoint> points,
                                                                double baseline_mm);

}  // namespace forgescan
