#include "services/reconstruction/mask_kernel.h"

#include <algorithm>
#include <cstddef>

#include "services/common/simd_target.h"

namespace forgescan {
namespace {

using In = std::span<const std::uint8_t>;
using Out = std::span<std::uint8_t>;
using Rows = std::span<const std::uint8_t* const>;

[[gnu::always_inline]] inline void JoinBytes(const std::uint8_t* from, std::uint8_t* __restrict to,
                                             std::size_t length) {
  for (std::size_t x = 0; x < length; ++x) {
    to[x] = static_cast<std::uint8_t>(to[x] | from[x]);
  }
}

[[gnu::always_inline]] inline void JoinRows(Rows rows, Out out) {
  const std::size_t length = out.size();
  std::uint8_t* const __restrict to = out.data();
  if (rows.size() == 5) {  // two px each side: the usual border, in one go
    const std::uint8_t *const a = rows[0], *const b = rows[1], *const c = rows[2], *const d = rows[3],
                              *const e = rows[4];
    for (std::size_t x = 0; x < length; ++x) {
      to[x] = static_cast<std::uint8_t>(a[x] | b[x] | c[x] | d[x] | e[x]);
    }
    return;
  }
  std::copy_n(rows[0], length, to);
  for (const std::uint8_t* const row : rows.subspan(1)) {
    JoinBytes(row, to, length);
  }
}

[[gnu::always_inline]] inline void WidenBytes(In in, int reach, Out out) {
  const std::size_t length = out.size();
  const std::uint8_t* const from = in.data();
  std::uint8_t* const __restrict to = out.data();
  if (reach == 4) {
    for (std::size_t x = 0; x < length; ++x) {
      to[x] = static_cast<std::uint8_t>(from[x] | from[x + 1] | from[x + 2] | from[x + 3] | from[x + 4]);
    }
    return;
  }
  for (std::size_t x = 0; x < length; ++x) {
    to[x] = from[x];
  }
  for (int shift = 1; shift <= reach; ++shift) {
    JoinBytes(from + shift, to, length);
  }
}

[[gnu::always_inline]] inline void MarkBytes(In near, std::uint8_t border, Out cause) {
  const std::size_t length = cause.size();
  const std::uint8_t* const from = near.data();
  std::uint8_t* const __restrict to = cause.data();
  for (std::size_t x = 0; x < length; ++x) {
    const std::uint8_t marked = from[x] != 0 ? border : std::uint8_t{0};
    to[x] = to[x] != 0 ? to[x] : marked;
  }
}

void WidenPlain(In in, int reach, Out out) { WidenBytes(in, reach, out); }
void JoinPlain(Rows rows, Out to) { JoinRows(rows, to); }
void MarkPlain(In near, std::uint8_t border, Out cause) { MarkBytes(near, border, cause); }

#if defined(__x86_64__)
FORGESCAN_TARGET_AVX2 void WidenAvx2(In in, int reach, Out out) { WidenBytes(in, reach, out); }
FORGESCAN_TARGET_AVX2 void JoinAvx2(Rows rows, Out to) { JoinRows(rows, to); }
FORGESCAN_TARGET_AVX2 void MarkAvx2(In near, std::uint8_t border, Out cause) {
  MarkBytes(near, border, cause);
}
FORGESCAN_TARGET_AVX512 void WidenAvx512(In in, int reach, Out out) { WidenBytes(in, reach, out); }
FORGESCAN_TARGET_AVX512 void JoinAvx512(Rows rows, Out to) { JoinRows(rows, to); }
FORGESCAN_TARGET_AVX512 void MarkAvx512(In near, std::uint8_t border, Out cause) {
  MarkBytes(near, border, cause);
}
#endif

}  // namespace

MaskKernel::MaskKernel(SimdPath path) : widen_(&WidenPlain), join_(&JoinPlain), mark_(&MarkPlain) {
#if defined(__x86_64__)
  if (path == SimdPath::kAvx2) {
    widen_ = &WidenAvx2;
    join_ = &JoinAvx2;
    mark_ = &MarkAvx2;
  } else if (path == SimdPath::kAvx512) {
    widen_ = &WidenAvx512;
    join_ = &JoinAvx512;
    mark_ = &MarkAvx512;
  }
#endif
}

}  // namespace forgescan
