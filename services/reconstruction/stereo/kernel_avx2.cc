// Compiled for AVX2; see CMakeLists.txt.
#include "services/reconstruction/stereo/kernel_functions.h"
#include "services/reconstruction/stereo/kernel_list.h"

namespace forgescan {

constinit const StereoKernel kAvx2StereoKernel = MakeStereoKernel("avx2");

}  // namespace forgescan
