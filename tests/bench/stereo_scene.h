// What the stereo bench looks at with a rig of two 5 MP cameras.
#pragma once

#include "tests/services/reconstruction/decoded_scene.h"

namespace forgescan::bench {

// f 3480 px, both lenses distorted, baseline 150 mm, axes meeting at 520 mm, projector of 1920 columns
// between the cameras.
StereoCalibration BenchRig();

// A tilted plate, a cylinder of 45 mm radius and a block 45 mm high upon it, with round holes; noise of 0.02
// projector px.
DecodedScene BenchScene();

}  // namespace forgescan::bench
