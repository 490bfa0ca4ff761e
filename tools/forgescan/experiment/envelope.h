// How far the centres of a ball pair scatter over repeated scans.
#pragma once

#include "services/common/result.h"
#include "tools/forgescan/experiment/ball_scene.h"

namespace forgescan {

struct Envelope {
  double first_mm = 0, second_mm = 0;  // radius of the minimum enclosing ball of each ball's centres
  double cone_rad = 0;                 // full apex angle of the narrowest cone about the centre lines
  double iso_mm = 0;                   // ISO 9283: mean distance from the barycentre + 3 standard deviations
};

// Errors: those of the enclosing ball and cone.
Result<Envelope> EnvelopeOf(const std::vector<BallPair>& visits);

}  // namespace forgescan
