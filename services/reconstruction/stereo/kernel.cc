#include "services/reconstruction/stereo/kernel.h"

#include <vector>

#include "services/reconstruction/stereo/kernel_list.h"

namespace forgescan {

std::span<const StereoKernel* const> StereoKernels() {
  static const std::vector<const StereoKernel*> kernels = [] {
    std::vector<const StereoKernel*> usable;
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
      usable.push_back(&kAvx512StereoKernel);
    }
    if (__builtin_cpu_supports("avx2")) {
      usable.push_back(&kAvx2StereoKernel);
    }
    usable.push_back(&kPlainStereoKernel);
    return usable;
  }();
  return kernels;
}

}  // namespace forgescan
