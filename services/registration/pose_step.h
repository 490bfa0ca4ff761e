// One step of point-to-plane alignment: the 6 x 6 system and what it says about the pose.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// A measured point with the surface point it belongs to. Units: mm. Frames: model.
struct Pair {
  Eigen::Vector3f point;
  Eigen::Vector3f foot;
  Eigen::Vector3f normal;  // unit, of the surface at foot
  float distance_mm;
  float weight;  // 0..1
};

// Rotations are about `center` and enter the system as reach_mm * angle, so that all six unknowns are mm. One
// reach per axis (the part's half diagonal across it): a long part turns about its own axis with a short
// lever.
struct StepFrame {
  Eigen::Vector3d center;
  Eigen::Vector3d reach_mm;
};

struct StepGuard {
  double min_eigenvalue;  // of the weighted mean of J^T J; below, the points do not fix the pose
  // Added to that mean's diagonal: a direction hardly seen stays where it is, others lose little.
  double damping = 0;
  unsigned threads = 1;  // 0: as many as the host has
};

// A motion the points hold, or hardly hold.
struct HeldMotion {
  Vector6 motion;     // unit; rotation about the centre * reach_mm, then translation: mm
  double eigenvalue;  // of the weighted mean of J^T J
};

struct PoseStep {
  Eigen::Isometry3d moved_from_before;  // exact rotation, from the exponential map
  double rotation_mm;                   // angles * reach_mm: the most the rotation moves a point
  double translation_mm;                // of the centre
  double rms_mm;                        // weighted, point to plane, before the step
  // Weakest first. An eigenvalue of 0 is a motion the points do not see; the weakest is at most 1/3.
  std::array<HeldMotion, 6> motions;
  Matrix6 covariance;  // of (rotation about center in rad, translation of center in mm), from the residuals
                       // as if independent
};

// "translation along x", "rotation about (0.00, 0.71, 0.71)": what a motion mostly is, in the model's axes.
std::string NameOfMotion(const Vector6& motion, const StepFrame& frame);

// Source: Eq. (5), (8), with the exact rotation in place of the linearised one. Sums run over blocks of fixed
// size in the order of the pairs: equal bytes for any number of threads. Errors: kDegenerate if fewer than 6
// pairs have weight, or the weakest eigenvalue is below min_eigenvalue, naming the motion.
Result<PoseStep> SolveStep(const std::vector<Pair>& pairs, const StepFrame& frame, const StepGuard& guard);

}  // namespace forgescan
