// Frames of a flat ramp: every pixel's projector column is known, so that phases and columns can be judged
// without a scene. The truth is the model I = A + B cos(phi + shift) itself.
#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "services/reconstruction/pattern_set.h"

namespace forgescan {

// 64, 63 and 56 fringes over 1984 px, of a projector of 1920 px: with own background 4 + 4 + 4 frames (the
// full set), with a shared one 3 + 2 + 2 (the paper's, Eq. (4)). No reference frame.
PatternSet SyntheticPattern(Background background);

// Grey value = dark + scale * emitted(0.5 + 0.45 cos(...)) + Gaussian noise.
struct RampScene {
  int width_px = 1024, height_px = 256;
  double dark_dn = 10, scale_dn = 200;
  double noise_dn = 0;
  // Light for a commanded level, both fractions of white; empty: equal.
  std::function<double(double)> emitted = {};
  std::uint64_t seed = 1;

  double modulation_dn() const { return 0.45 * scale_dn; }  // B, where the projector is linear
};

// Projector column of a pixel: 100 to 1800 px, rows shifted against each other so that all phases occur.
double RampColumnPx(const RampScene& scene, int x, int y);

// 16-bit frames (257 counts a grey value), so that rounding does not matter. Errors: none.
std::vector<cv::Mat> RampFrames(const PatternSet& pattern, const RampScene& scene);

// Phase of a frequency at a projector column, rad.
double PhaseAt(const FringeFrequency& frequency, double column_px);

// x - 2 pi n, in [-pi, pi].
double Wrapped(double rad);

}  // namespace forgescan
