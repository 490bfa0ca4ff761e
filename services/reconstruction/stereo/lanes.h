// Sixteen floats side by side, and masks of them: what the stereo kernels compute with. One translation unit
// each for AVX-512, AVX2 and plain x86-64 includes this; every operation gives the same bits on all of them
// (no fused multiply-add, see CMakeLists.txt). Nothing here may be called from elsewhere.
#pragma once

#include <immintrin.h>

#include <cstdint>

#define FORGESCAN_INLINE inline __attribute__((always_inline))

namespace forgescan {
namespace {

constexpr int kLanes = 16;
using Floats = float __attribute__((vector_size(64)));
using Ints = std::int32_t __attribute__((vector_size(64)));

FORGESCAN_INLINE Floats Load(const float* at) {
  Floats value;
  __builtin_memcpy(&value, at, sizeof(value));
  return value;
}
// At any address. Not by memcpy, after which the compiler takes every pointer and number in memory for
// changed. A typedef, because clang overlooks the alignment in `using`.
typedef float LooseFloats __attribute__((vector_size(64), aligned(4)));
FORGESCAN_INLINE void Store(float* at, Floats value) { *reinterpret_cast<LooseFloats*>(at) = value; }
FORGESCAN_INLINE Floats All(float value) { return value - Floats{}; }
FORGESCAN_INLINE Floats LaneNumbers() { return Floats{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}; }
FORGESCAN_INLINE Floats Magnitude(Floats value) { return (Floats)((Ints)value & 0x7fffffff); }
// Towards zero; |value| < 2^31.
FORGESCAN_INLINE Floats Truncated(Floats value) {
  return __builtin_convertvector(__builtin_convertvector(value, Ints), Floats);
}

#ifdef __AVX512F__

struct Mask {
  __mmask16 bits;
};
FORGESCAN_INLINE unsigned Bits(Mask mask) { return mask.bits; }
FORGESCAN_INLINE Mask FromBits(unsigned bits) { return {static_cast<__mmask16>(bits)}; }
FORGESCAN_INLINE Mask Less(Floats a, Floats b) { return {_mm512_cmp_ps_mask(a, b, _CMP_LT_OQ)}; }
FORGESCAN_INLINE Mask LessEqual(Floats a, Floats b) { return {_mm512_cmp_ps_mask(a, b, _CMP_LE_OQ)}; }
FORGESCAN_INLINE Mask Equal(Floats a, Floats b) { return {_mm512_cmp_ps_mask(a, b, _CMP_EQ_OQ)}; }
FORGESCAN_INLINE Floats Select(Mask mask, Floats yes, Floats no) {
  return _mm512_mask_blend_ps(mask.bits, no, yes);
}
FORGESCAN_INLINE Ints CountUp(Ints count, Mask mask) {
  return (Ints)_mm512_mask_add_epi32((__m512i)count, mask.bits, (__m512i)count, _mm512_set1_epi32(1));
}
FORGESCAN_INLINE Mask Above(Ints a, int limit) {
  return {_mm512_cmpgt_epi32_mask((__m512i)a, _mm512_set1_epi32(limit))};
}
// Whether low <= value <= high, with low > 0; not of NaN. Numbers above 0 are in the order of their bits.
FORGESCAN_INLINE Mask IsWithin(Floats value, float low, float high) {
  const __m512i first = (__m512i)All(low), span = _mm512_sub_epi32((__m512i)All(high), first);
  return {_mm512_cmple_epu32_mask(_mm512_sub_epi32((__m512i)value, first), span)};
}
// Floats of which only the upper halves are stored.
FORGESCAN_INLINE Floats SelectUpper(Mask mask, const std::uint16_t* yes, const std::uint16_t* no) {
  const __m256i upper =
      _mm256_mask_loadu_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(no)), mask.bits, yes);
  return (Floats)_mm512_slli_epi32(_mm512_cvtepu16_epi32(upper), 16);
}
FORGESCAN_INLINE Floats Sqrt(Floats value) { return _mm512_sqrt_ps(value); }
// To the beginning of a cache line, past the cache.
FORGESCAN_INLINE void StoreLine(float* line, Floats value) { _mm512_stream_ps(line, value); }
// Lanes kFirst, kFirst + 1, ... of the 32 that low and high are.
template <int kFirst>
FORGESCAN_INLINE Floats Shifted(Floats low, Floats high) {
  return (Floats)_mm512_maskz_alignr_epi32(0xffff, (__m512i)high, (__m512i)low, kFirst);
}
// from[index] for 0 <= index < 32; other lanes are anything.
class NearTable {
 public:
  FORGESCAN_INLINE explicit NearTable(const float* from) : low_(Load(from)), high_(Load(from + kLanes)) {}
  FORGESCAN_INLINE Floats operator[](Ints index) const {
    return _mm512_permutex2var_ps(low_, (__m512i)index, high_);
  }

 private:
  Floats low_, high_;
};
FORGESCAN_INLINE Floats LookUp(const float* from, Ints index) {
  return _mm512_mask_i32gather_ps(Floats{}, 0xffff, (__m512i)index, from, 4);
}
// The chosen lanes, one behind the other; then anything.
FORGESCAN_INLINE Floats Packed(Mask mask, Floats value) { return _mm512_maskz_compress_ps(mask.bits, value); }
// x, y, z of lane after lane.
FORGESCAN_INLINE void StoreTriples(float* at, Floats x, Floats y, Floats z) {
  alignas(64) static constexpr int kXy[3][16] = {{0, 16, 0, 1, 17, 0, 2, 18, 0, 3, 19, 0, 4, 20, 0, 5},
                                                 {21, 0, 6, 22, 0, 7, 23, 0, 8, 24, 0, 9, 25, 0, 10, 26},
                                                 {0, 11, 27, 0, 12, 28, 0, 13, 29, 0, 14, 30, 0, 15, 31, 0}};
  alignas(64) static constexpr int kZ[3][16] = {{0, 1, 16, 3, 4, 17, 6, 7, 18, 9, 10, 19, 12, 13, 20, 15},
                                                {0, 21, 2, 3, 22, 5, 6, 23, 8, 9, 24, 11, 12, 25, 14, 15},
                                                {26, 1, 2, 27, 4, 5, 28, 7, 8, 29, 10, 11, 30, 13, 14, 31}};
  for (int i = 0; i < 3; ++i) {
    const Floats xy = _mm512_permutex2var_ps(x, _mm512_load_si512(kXy[i]), y);
    Store(at + i * kLanes, _mm512_permutex2var_ps(xy, _mm512_load_si512(kZ[i]), z));
  }
}

#else

struct Mask {
  Ints lanes;
};
FORGESCAN_INLINE unsigned Bits(Mask mask) {
  unsigned bits = 0;
  for (int i = 0; i < 4; ++i) {
    __m128 four;
    __builtin_memcpy(&four, reinterpret_cast<const char*>(&mask) + 16 * i, sizeof(four));
    bits |= static_cast<unsigned>(_mm_movemask_ps(four)) << (4 * i);
  }
  return bits;
}
FORGESCAN_INLINE Mask FromBits(unsigned bits) {
  constexpr Ints kBit = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
  return {((Ints{} + static_cast<int>(bits)) & kBit) != 0};
}
FORGESCAN_INLINE Mask Less(Floats a, Floats b) { return {a < b}; }
FORGESCAN_INLINE Mask LessEqual(Floats a, Floats b) { return {a <= b}; }
FORGESCAN_INLINE Mask Equal(Floats a, Floats b) { return {a == b}; }
FORGESCAN_INLINE Floats Select(Mask mask, Floats yes, Floats no) {
  return (Floats)(((Ints)yes & mask.lanes) | ((Ints)no & ~mask.lanes));
}
FORGESCAN_INLINE Mask IsWithin(Floats value, float low, float high) {
  return {(All(low) <= value) & (value <= All(high))};
}
FORGESCAN_INLINE Floats LoadUpper(const std::uint16_t* at) {
  std::uint16_t __attribute__((vector_size(32))) upper;
  __builtin_memcpy(&upper, at, sizeof(upper));
  return (Floats)(__builtin_convertvector(upper, Ints) << 16);
}
FORGESCAN_INLINE Floats SelectUpper(Mask mask, const std::uint16_t* yes, const std::uint16_t* no) {
  return Select(mask, LoadUpper(yes), LoadUpper(no));
}
FORGESCAN_INLINE Ints CountUp(Ints count, Mask mask) { return count - mask.lanes; }
FORGESCAN_INLINE Mask Above(Ints a, int limit) { return {a > limit}; }
FORGESCAN_INLINE void StoreLine(float* line, Floats value) {
  for (int i = 0; i < 4; ++i) {
    __m128 four;
    __builtin_memcpy(&four, reinterpret_cast<const char*>(&value) + 16 * i, sizeof(four));
    _mm_stream_ps(line + 4 * i, four);
  }
}
FORGESCAN_INLINE Floats Sqrt(Floats value) {
  for (int i = 0; i < 4; ++i) {
    __m128 four;
    __builtin_memcpy(&four, reinterpret_cast<const char*>(&value) + 16 * i, sizeof(four));
    four = _mm_sqrt_ps(four);
    __builtin_memcpy(reinterpret_cast<char*>(&value) + 16 * i, &four, sizeof(four));
  }
  return value;
}
template <int kFirst>
FORGESCAN_INLINE Floats Shifted(Floats low, Floats high) {
  float both[2 * kLanes];
  Store(both, low);
  Store(both + kLanes, high);
  return Load(both + kFirst);
}
FORGESCAN_INLINE Floats LookUp(const float* from, Ints index) {
  Floats value;
  for (int i = 0; i < kLanes; ++i) {
    value[i] = from[index[i]];
  }
  return value;
}
class NearTable {
 public:
  FORGESCAN_INLINE explicit NearTable(const float* from) : from_(from) {}
  FORGESCAN_INLINE Floats operator[](Ints index) const { return LookUp(from_, index & (2 * kLanes - 1)); }

 private:
  const float* from_;
};
FORGESCAN_INLINE Floats Packed(Mask mask, Floats value) {
  float packed[kLanes + 1] = {};
  const unsigned bits = Bits(mask);
  int count = 0;
  for (int i = 0; i < kLanes; ++i) {
    packed[count] = value[i];
    count += static_cast<int>(bits >> i & 1);
  }
  return Load(packed);
}
FORGESCAN_INLINE void StoreTriples(float* at, Floats x, Floats y, Floats z) {
  for (int i = 0; i < kLanes; ++i) {
    at[3 * i] = x[i];
    at[3 * i + 1] = y[i];
    at[3 * i + 2] = z[i];
  }
}

#endif

FORGESCAN_INLINE Mask operator&(Mask a, Mask b) {
#ifdef __AVX512F__
  return {static_cast<__mmask16>(a.bits & b.bits)};
#else
  return {a.lanes & b.lanes};
#endif
}
// a and not b
FORGESCAN_INLINE Mask Without(Mask a, Mask b) {
#ifdef __AVX512F__
  return {static_cast<__mmask16>(a.bits & ~b.bits)};
#else
  return {a.lanes & ~b.lanes};
#endif
}
FORGESCAN_INLINE Mask operator|(Mask a, Mask b) {
#ifdef __AVX512F__
  return {static_cast<__mmask16>(a.bits | b.bits)};
#else
  return {a.lanes | b.lanes};
#endif
}
FORGESCAN_INLINE bool Any(Mask mask) { return Bits(mask) != 0; }
FORGESCAN_INLINE long Count(Mask mask) { return __builtin_popcount(Bits(mask)); }
FORGESCAN_INLINE Mask IsNumber(Floats value) { return Equal(value, value); }

}  // namespace
}  // namespace forgescan
