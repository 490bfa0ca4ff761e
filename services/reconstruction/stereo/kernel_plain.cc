// Compiled for every x86-64; see CMakeLists.txt.
#include "services/reconstruction/stereo/kernel_functions.h"
#include "services/reconstruction/stereo/kernel_list.h"

namespace forgescan {

constinit const StereoKernel kPlainStereoKernel = MakeStereoKernel("plain");

}  // namespace forgescan
