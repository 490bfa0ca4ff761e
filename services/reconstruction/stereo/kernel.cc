#include "services/reconstruction/stereo/kernel.h"

#include <vector>

#include "services/common/simd_path.h"
#include "services/reconstruction/stereo/kernel_list.h"

namespace forgescan {

std::span<const StereoKernel* const> StereoKernels() {
  static const std::vector<const StereoKernel*> kernels = [] {
    constexpr const StereoKernel* kByPath[] = {&kPlainStereoKernel, &kAvx2StereoKernel, &kAvx512StereoKernel};
    std::vector<const StereoKernel*> usable;
    for (const SimdPath path : AvailableSimdPaths()) {
      usable.insert(usable.begin(), kByPath[static_cast<std::size_t>(path)]);
    }
    return usable;
  }();
  return kernels;
}

}  // namespace forgescan
