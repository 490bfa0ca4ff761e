// A calibrated projector in the form the stereo kernels compute with.
#pragma once

#include "services/common/imaging/stereo_calibration.h"
#include "services/reconstruction/reconstruction_config.h"
#include "services/reconstruction/stereo/kernel.h"

namespace forgescan {

// projector: its pose from the rectified left camera.
ProjectorModel MakeProjectorModel(const ProjectorCalibration& projector, const ReconstructionConfig& config);

}  // namespace forgescan
