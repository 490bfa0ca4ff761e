// Plain loops over short arrays, which the compiler turns into vector instructions: the same loops are
// compiled once for each kind. Whole-number arithmetic and single float operations, never contracted
// (-ffp-contract=off), give equal bits on each.
#include "services/reconstruction/packed_kernel.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "services/reconstruction/decoded_view.h"

namespace forgescan {
namespace {

using I16 = std::int16_t;
using U16 = std::uint16_t;
using I32 = std::int32_t;
using U32 = std::uint32_t;

// Inlined into each of the compiled kinds; a function of its own would be compiled for the plainest one.
#define FORGESCAN_INLINE [[gnu::always_inline]] inline

constexpr int kLanes = PackedKernel::kMaxLength;
template <typename T>
using Lane = std::array<T, kLanes>;

// All of a strip's arrays: 35 kB, so that they stay in the first-level cache.
struct alignas(64) Work {
  Lane<U16> level;                    // 2 A, DN
  std::array<Lane<I16>, 3> c;         // 2 C, DN
  std::array<Lane<I16>, 3> s;         // 2 S
  std::array<Lane<U16>, 3> most;      // greater of |c| and |s|, at least 1
  std::array<Lane<U16>, 3> slope;     // lesser over greater, 2^-16
  std::array<Lane<I16>, 3> is_steep;  // -1 where |s| is the greater one
  std::array<Lane<U16>, 3> phase;
  std::array<Lane<U16>, 3> modulation;
  Lane<U16> order;
  Lane<U16> outside;  // of the projector's field
  std::array<Lane<U16>, 2>
      code;         // the others' phases less their share of the finest one; then what they disagree by
  Lane<U16> white;  // expected, 1/64 DN
  Lane<U16> white_off;
  Lane<U16> excess;       // of the modulations' ratios, 1/64 DN
  Lane<U16> least;        // modulation
  Lane<U16> quiet;        // least modulation, scaled by the slots' noise
  Lane<U16> squares;      // of the frames' influence on the coordinate, 2^-16
  Lane<U16> lit_squares;  // the same times grey value over 256
  Lane<std::uint8_t> peak;
};

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("avx2,prefer-vector-width=256")
namespace avx2 {
constexpr int kBytes = 32;
#define FORGESCAN_HIGH(a, b) (V) _mm256_mulhi_epu16((__m256i)(a), (__m256i)(b))
#include "services/reconstruction/packed_kernel_loops.inc"
#undef FORGESCAN_HIGH
}  // namespace avx2
#pragma GCC pop_options

#pragma GCC push_options
#pragma GCC target("avx512f,avx512bw,avx512vl,avx512dq,prefer-vector-width=512")
namespace avx512 {
constexpr int kBytes = 64;
#define FORGESCAN_HIGH(a, b) (V) _mm512_mulhi_epu16((__m512i)(a), (__m512i)(b))
#include "services/reconstruction/packed_kernel_loops.inc"
#undef FORGESCAN_HIGH
}  // namespace avx512
#pragma GCC pop_options
#endif

namespace baseline {
constexpr int kBytes = 16;
#if defined(__x86_64__)
#define FORGESCAN_HIGH(a, b) (V) _mm_mulhi_epu16((__m128i)(a), (__m128i)(b))
#else
using Wide [[gnu::vector_size(32)]] = std::uint32_t;
#define FORGESCAN_HIGH(a, b) \
  __builtin_convertvector((__builtin_convertvector(a, Wide) * __builtin_convertvector(b, Wide)) >> 16, V)
#endif
#include "services/reconstruction/packed_kernel_loops.inc"
}  // namespace baseline

}  // namespace

PackedKernel::PackedKernel(SimdPath path) : run_(&baseline::DecodeStrip) {
#if defined(__x86_64__)
  run_ = path == SimdPath::kAvx512 ? &avx512::DecodeStrip
         : path == SimdPath::kAvx2 ? &avx2::DecodeStrip
                                   : run_;
#endif
}

}  // namespace forgescan
