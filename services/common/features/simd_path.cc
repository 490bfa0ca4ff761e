#include "services/common/features/simd_path.h"

namespace forgescan {

SimdPath BestSimdPath() {
  static const SimdPath best = [] {
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return SimdPath::kAvx512;
    return __builtin_cpu_supports("avx2") ? SimdPath::kAvx2 : SimdPath::kPlain;
  }();
  return best;
}

}  // namespace forgescan
