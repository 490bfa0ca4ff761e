// Which vector instructions a kernel uses. All paths give equal bytes; they differ in speed only.
#pragma once

#include <string_view>
#include <vector>

namespace forgescan {

enum class SimdPath { kPlain, kAvx2, kAvx512 };

// What this processor can run, slowest first; kPlain is always there.
std::vector<SimdPath> AvailableSimdPaths();
SimdPath BestSimdPath();
std::string_view NameOf(SimdPath path);

}  // namespace forgescan
