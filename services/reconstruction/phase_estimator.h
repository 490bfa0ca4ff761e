// From grey values to phases: one linear least-squares problem a pixel, solved once for all pixels.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/common/result.h"
#include "services/reconstruction/pattern_set.h"

namespace forgescan {

// Time is counted in frames, in the order of the view's frames.
// Model: I_i = A + B_j cos(phi_j + shift_i) = A + C_j cos(shift_i) - S_j sin(shift_i), C = B cos(phi), S = B
// sin(phi), with one A a frequency (own background) or one for all (shared). The solution is linear in the
// frames: C_j = sum_i cosine(j,i) I_i. Source: PAPER 2.2.1, Eq. (1)-(4); for 4 own frames it is the classic
// arctan, for 3-2-2 shared frames exactly Eq. (4). Shape: frequencies x frames; columns of the reference
// frame are 0. Units: none.
struct PhaseEstimator {
  Eigen::MatrixXd cosine;
  Eigen::MatrixXd sine;
  Eigen::MatrixXd background;
  Eigen::MatrixXd residual;  // frames x frames: what the model leaves of the frames
  // Drift of the background from one frame to the next, 1 x frames: only with a shared background and a
  // mid-grey reference. Then A is a straight line in time, the reference is one more frame of it, and the
  // phases are free of the drift.
  std::optional<Eigen::RowVectorXd> drift;
  // Largest error of each phase, rad, by a drift of one B a frame. Source: linear, C and S shift by what the
  // drift puts there; for 3-2-2 frames 1.0, 3.6 and 6.4, for 2-3-2 frames 3.6, 1.0 and 3.6.
  std::vector<double> drift_gain;
  int redundancy = 0;  // frames minus unknowns
  std::vector<double>
      fusion;  // weights of the frequencies' coordinates, sum 1: best for phases of average variance

  // Standard deviation of a phase over sigma / B (sigma of a grey value), averaged over all phases: 0.71 for
  // 4 own frames, 1.0 and 1.22 for 3-2-2 shared ones.
  double PhaseNoise(int frequency) const;
  // Variance of a phase at phase_rad over (sigma / B)^2: 1/2 for 4 own frames; 1 + cos(2 phi) / 2 and
  // 1.5 + sin(2 phi) / 2 for the three-frame and the two-frame frequencies of a shared 3-2-2 set. To first
  // order.
  double PhaseVariance(int frequency, double phase_rad) const;
  // Standard deviation of A + per_modulation B, what the reference frame should show, over sigma, at the
  // worst phase.
  double ReferenceNoise(int frequency, double per_modulation) const;
};

// Errors: kInvalidArgument from Check(pattern); kDegenerate when the shifts do not determine the phases.
Result<PhaseEstimator> MakePhaseEstimator(const PatternSet& pattern);

// Angle of (cosine, sine) in turns, [0, 1]. Error below 1e-6 rad. Branch-free, so that loops over it
// vectorise. Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.
inline float TurnsFromPhasor(float cosine, float sine) {
  constexpr float kTurnsPerRad = 0.15915494309f;
  constexpr float kTiny = 1e-30f;  // a phasor of length 0 gets the angle 0; the modulation mask removes it
  const float x = cosine < 0 ? -cosine : cosine;
  const float y = sine < 0 ? -sine : sine;
  const float small = x < y ? x : y;
  const float large = x < y ? y : x;
  const float q = small / (large + kTiny);
  const float z = q * q;
  float series = 0.0028662257f;
  series = series * z - 0.0161657367f;
  series = series * z + 0.0429096138f;
  series = series * z - 0.0752896400f;
  series = series * z + 0.1065626393f;
  series = series * z - 0.1420889944f;
  series = series * z + 0.1999355085f;
  series = series * z - 0.3333314528f;
  const float octant = (series * z + 1.0f) * q * kTurnsPerRad;
  const float quadrant = x < y ? 0.25f - octant : octant;
  const float half = cosine < 0 ? 0.5f - quadrant : quadrant;
  return sine < 0 ? 1.0f - half : half;
}

}  // namespace forgescan
