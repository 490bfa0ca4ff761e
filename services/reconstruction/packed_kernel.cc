// Plain loops over short arrays, which the compiler turns into vector instructions: the same loops are
// compiled once for each kind. Whole-number arithmetic and single float operations, never contracted
// (-ffp-contract=off), give equal bits on each.
#include "services/reconstruction/packed_kernel.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "services/common/simd_target.h"
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

constexpr int kBlock = PackedKernel::kBlock;
static_assert(PackedKernel::kMaxLength / kBlock <= 32, "FindLit has a bit for each block");

// All of a strip's arrays: 12 kB, so that they stay in the first-level cache.
struct alignas(64) Work {
  Lane<U16> level;  // 2 A, DN
  std::array<Lane<U16>, 3> phase;
  std::array<Lane<U16>, 3> modulation;
  std::array<Lane<U16>, 2> code;  // the others' phases less their share of the finest one
  Lane<U16> cell;
  Lane<U16> peak;  // greatest of the frames, DN
  Lane<std::uint8_t> order;
};

// One by one: a processor loads two entries a cycle, its instruction that collects them is not faster, and
// what a compiler makes of it is slower.
#if defined(__GNUC__) && !defined(__clang__)
[[gnu::optimize("no-tree-vectorize")]]
#endif
void LookUp(const std::uint8_t* cells, const U16* cell, std::uint8_t* order, int length) {
#pragma GCC unroll 8
  for (int x = 0; x < length; ++x) {
    order[x] = cells[cell[x]];
  }
}

// The functions between them are compiled for these instructions.
#define FORGESCAN_PRAGMA(text) _Pragma(#text)
#if defined(__clang__)
#define FORGESCAN_BEGIN_TARGET(target_) \
  FORGESCAN_PRAGMA(clang attribute push(__attribute__((target(target_))), apply_to = function))
#define FORGESCAN_END_TARGET FORGESCAN_PRAGMA(clang attribute pop)
#else
#define FORGESCAN_BEGIN_TARGET(target_) \
  FORGESCAN_PRAGMA(GCC push_options) FORGESCAN_PRAGMA(GCC target(target_))
#define FORGESCAN_END_TARGET FORGESCAN_PRAGMA(GCC pop_options)
#endif

FORGESCAN_BEGIN_TARGET(FORGESCAN_AVX2)
namespace avx2 {
constexpr int kBytes = 32;
#define FORGESCAN_HIGH(a, b) (V) _mm256_mulhi_epu16((__m256i)(a), (__m256i)(b))
#define FORGESCAN_EXCESS(a, b) (V) _mm256_subs_epu16((__m256i)(a), (__m256i)(b))
#define FORGESCAN_PAIR_SUMS(a, b) (Wide) _mm256_madd_epi16((__m256i)(a), (__m256i)(b))
#define FORGESCAN_WIDEN(bytes) \
  (V) _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes)))
#define FORGESCAN_GATHER(table, index) \
  (Wide) _mm256_i32gather_epi32(reinterpret_cast<const int*>(table), (__m256i)(index), 4)
#include "services/reconstruction/packed_kernel_loops.inc"
#undef FORGESCAN_HIGH
#undef FORGESCAN_EXCESS
#undef FORGESCAN_PAIR_SUMS
#undef FORGESCAN_WIDEN
#undef FORGESCAN_GATHER
}  // namespace avx2
FORGESCAN_END_TARGET

FORGESCAN_BEGIN_TARGET(FORGESCAN_AVX512)
namespace avx512 {
constexpr int kBytes = 64;
#define FORGESCAN_HIGH(a, b) (V) _mm512_mulhi_epu16((__m512i)(a), (__m512i)(b))
#define FORGESCAN_EXCESS(a, b) (V) _mm512_subs_epu16((__m512i)(a), (__m512i)(b))
#define FORGESCAN_PAIR_SUMS(a, b) (Wide) _mm512_madd_epi16((__m512i)(a), (__m512i)(b))
#define FORGESCAN_WIDEN(bytes) \
  (V) _mm512_cvtepu8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(bytes)))
#define FORGESCAN_GATHER(table, index) (Wide) _mm512_i32gather_epi32((__m512i)(index), table, 4)
#include "services/reconstruction/packed_kernel_loops.inc"
#undef FORGESCAN_HIGH
#undef FORGESCAN_EXCESS
#undef FORGESCAN_PAIR_SUMS
#undef FORGESCAN_WIDEN
#undef FORGESCAN_GATHER
}  // namespace avx512
FORGESCAN_END_TARGET

namespace baseline {
constexpr int kBytes = 16;
#define FORGESCAN_WIDEN(bytes) __builtin_convertvector(*reinterpret_cast<const Bytes*>(bytes), V)
#define FORGESCAN_GATHER(table, index) \
  Wide { (I32) table[index[0]], (I32)table[index[1]], (I32)table[index[2]], (I32)table[index[3]] }
#define FORGESCAN_HIGH(a, b) (V) _mm_mulhi_epu16((__m128i)(a), (__m128i)(b))
#define FORGESCAN_EXCESS(a, b) (V) _mm_subs_epu16((__m128i)(a), (__m128i)(b))
#define FORGESCAN_PAIR_SUMS(a, b) (Wide) _mm_madd_epi16((__m128i)(a), (__m128i)(b))
#include "services/reconstruction/packed_kernel_loops.inc"
#undef FORGESCAN_HIGH
#undef FORGESCAN_EXCESS
#undef FORGESCAN_PAIR_SUMS
#undef FORGESCAN_WIDEN
#undef FORGESCAN_GATHER
}  // namespace baseline

}  // namespace

PackedKernel::PackedKernel(SimdPath path)
    : run_(path == SimdPath::kAvx512 ? &avx512::DecodeStrip
           : path == SimdPath::kAvx2 ? &avx2::DecodeStrip
                                     : &baseline::DecodeStrip) {}

}  // namespace forgescan
