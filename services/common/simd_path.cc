#include "services/common/simd_path.h"

#include <array>

namespace forgescan {

std::vector<SimdPath> AvailableSimdPaths() {
  std::vector<SimdPath> paths = {SimdPath::kPlain};
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") != 0) {
    paths.push_back(SimdPath::kAvx2);
    if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
        __builtin_cpu_supports("avx512vl") != 0 && __builtin_cpu_supports("avx512dq") != 0) {
      paths.push_back(SimdPath::kAvx512);
    }
  }
#endif
  return paths;
}

SimdPath BestSimdPath() { return AvailableSimdPaths().back(); }

std::string_view NameOf(SimdPath path) {
  constexpr std::array<std::string_view, 3> kNames = {"plain", "avx2", "avx512"};
  return kNames[static_cast<std::size_t>(path)];
}

}  // namespace forgescan
