#pragma once

#include "services/reconstruction/stereo/kernel.h"

namespace forgescan {

extern const StereoKernel kPlainStereoKernel;
extern const StereoKernel kAvx2StereoKernel;
extern const StereoKernel kAvx512StereoKernel;

}  // namespace forgescan
