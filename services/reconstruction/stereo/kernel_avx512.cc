// Compiled for AVX-512 (F, BW, DQ, VL); see CMakeLists.txt.
#include "services/reconstruction/stereo/kernel_functions.h"
#include "services/reconstruction/stereo/kernel_list.h"

namespace forgescan {

constinit const StereoKernel kAvx512StereoKernel = MakeStereoKernel("avx512");

}  // namespace forgescan
