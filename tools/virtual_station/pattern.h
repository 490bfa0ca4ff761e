// What the projector shows, and how much light of it leaves the lens.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/virtual_station/cell_config.h"

namespace forgescan {

// A sinusoid over projector x, level = mean + amplitude cos(2 pi u / period + shift), or plain white where
// period_px is 0.
struct Pattern {
  double period_px = 0.0;
  double shift_deg = 0.0;
};

enum class ProjectedSet {
  kReduced,  // 3 + 2 + 2 sinusoids on one background, then white
  kFull,     // 4 + 4 + 4 sinusoids, then white
};

// In the order of projection. The reduced set has its three-step frequency in the middle, where a slow drift
// of the light disturbs least, and the reference last.
std::vector<Pattern> ProjectedPatterns(const ProjectorLightConfig& light, ProjectedSet set);

// Light at projector coordinate u, fraction of white: the pattern after the projector's remaining
// non-linearity, the lens blur and the black level. Independent of u for white.
double PatternLevel(const ProjectorLightConfig& light, const Pattern& pattern, double u_px);

}  // namespace forgescan
