// Which instructions an inner loop is run with. All paths give equal bytes; they differ in time only.
#pragma once

namespace forgescan {

enum class SimdPath { kPlain, kAvx2, kAvx512 };

// The widest the computer has.
SimdPath BestSimdPath();

}  // namespace forgescan
