// Plain loops over short arrays, which the compiler turns into vector instructions: the same loops are
// compiled once for each kind. Whole-number arithmetic and single float operations, never contracted
// (-ffp-contract=off), give equal bits on each.
#include "services/reconstruction/packed_kernel.h"

#include <bit>

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

// All of a strip's arrays: 34 kB, so that they stay in the first-level cache.
struct alignas(64) Work {
  Lane<U16> level;                 // 2 A, DN
  std::array<Lane<I16>, 3> c;      // 2 C, DN
  std::array<Lane<I16>, 3> s;      // 2 S
  std::array<Lane<U16>, 3> most;   // greater of |c| and |s|, at least 1
  std::array<Lane<U16>, 3> slope;  // lesser over greater, 2^-16
  std::array<Lane<U16>, 3> phase;
  std::array<Lane<U16>, 3> modulation;
  Lane<U16> order;
  std::array<Lane<I16>, 2> off;  // disagreement of the others, 2^-16 turn
  Lane<I32> cell;
  Lane<U16> white;  // expected, 1/64 DN
  Lane<U16> white_off;
  Lane<U16> excess;       // of the modulations' ratios, 1/64 DN
  Lane<U16> least;        // modulation
  Lane<U16> quiet;        // least modulation, scaled by the slots' noise
  Lane<U16> squares;      // of the frames' influence on the coordinate, 2^-16
  Lane<U16> lit_squares;  // the same times grey value over 256
  Lane<std::uint8_t> peak;
};

FORGESCAN_INLINE U16 High(U16 a, U16 b) { return static_cast<U16>((static_cast<U32>(a) * b) >> 16); }
FORGESCAN_INLINE U16 Distance(U16 a, U16 b) {
  return a > b ? static_cast<U16>(a - b) : static_cast<U16>(b - a);
}
FORGESCAN_INLINE U16 Magnitude(I16 a) { return static_cast<U16>(a < 0 ? -a : a); }
FORGESCAN_INLINE U16 Lesser(U16 a, U16 b) { return a < b ? a : b; }
FORGESCAN_INLINE U16 Greater(U16 a, U16 b) { return a < b ? b : a; }
FORGESCAN_INLINE U16 Square(I16 a) {
  const U16 twice = static_cast<U16>(2 * Magnitude(a));
  return High(twice, twice);
}

FORGESCAN_INLINE void LoadThree(const PackedStrip& strip, Work& w) {
  const std::uint8_t *const f1 = strip.frames[0], *const f2 = strip.frames[1], *const f3 = strip.frames[2];
  for (int x = 0; x < strip.length; ++x) {
    const I16 sum = static_cast<I16>(f1[x] + f3[x]);
    w.level[x] = static_cast<U16>(sum);
    w.c[0][x] = static_cast<I16>(f1[x] - f3[x]);
    w.s[0][x] = static_cast<I16>(sum - 2 * f2[x]);
  }
}

FORGESCAN_INLINE void LoadTwo(const PackedStrip& strip, int slot, Work& w) {
  const std::uint8_t *const f1 = strip.frames[1 + 2 * slot], *const f2 = strip.frames[2 + 2 * slot];
  I16 *const c = w.c[slot].data(), *const s = w.s[slot].data();
  for (int x = 0; x < strip.length; ++x) {
    c[x] = static_cast<I16>(2 * f1[x] - w.level[x]);
    s[x] = static_cast<I16>(w.level[x] - 2 * f2[x]);
  }
}

FORGESCAN_INLINE void FindPeak(const PackedStrip& strip, Work& w) {
  const auto& f = strip.frames;
  for (int x = 0; x < strip.length; ++x) {
    const auto greater = [](std::uint8_t a, std::uint8_t b) { return a < b ? b : a; };
    const std::uint8_t a = greater(greater(f[0][x], f[1][x]), greater(f[2][x], f[3][x]));
    const std::uint8_t b = greater(greater(f[4][x], f[5][x]), f[6][x]);
    w.peak[x] = greater(a, b);
  }
}

// One division serves three slopes.
FORGESCAN_INLINE void FindSlopes(int length, Work& w) {
  for (int j = 0; j < 3; ++j) {
    const I16 *const c = w.c[j].data(), *const s = w.s[j].data();
    U16 *const most = w.most[j].data(), *const least = w.slope[j].data();
    for (int x = 0; x < length; ++x) {
      const U16 a = Magnitude(c[x]), b = Magnitude(s[x]);
      most[x] = Greater(Greater(a, b), 1);
      least[x] = Lesser(a, b);
    }
  }
  constexpr float kOne = 65535;
  for (int x = 0; x < length; ++x) {
    const float m0 = w.most[0][x], m1 = w.most[1][x], m2 = w.most[2][x];
    const float first_two = m0 * m1;
    const float inverse = kOne / (first_two * m2);
    const float last_inverse = inverse * m2;
    w.slope[0][x] = static_cast<U16>(static_cast<I32>(w.slope[0][x] * (last_inverse * m1) + 0.5f));
    w.slope[1][x] = static_cast<U16>(static_cast<I32>(w.slope[1][x] * (last_inverse * m0) + 0.5f));
    w.slope[2][x] = static_cast<U16>(static_cast<I32>(w.slope[2][x] * (inverse * first_two) + 0.5f));
  }
}

// arctan(q) / 2 pi and sqrt(1 + q^2) for q in 0..1: minimax polynomials, errors 1.1e-5 rad and 8e-5.
FORGESCAN_INLINE void FindPhase(int length, int slot, Work& w) {
  const I16 *const c = w.c[slot].data(), *const s = w.s[slot].data();
  const U16 *const slope = w.slope[slot].data(), *const most = w.most[slot].data();
  U16 *const phase = w.phase[slot].data(), *const modulation = w.modulation[slot].data();
  for (int x = 0; x < length; ++x) {
    const U16 q = slope[x], z = High(q, q);
    const U16 series = static_cast<U16>(
        41716 -
        High(z,
             static_cast<U16>(
                 13781 - High(z, static_cast<U16>(7517 - High(z, static_cast<U16>(3553 - High(z, 870))))))));
    const U16 octant = static_cast<U16>((High(q, series) + 2) >> 2);
    const U16 quadrant = Magnitude(s[x]) > Magnitude(c[x]) ? static_cast<U16>(16384 - octant) : octant;
    const U16 half = c[x] < 0 ? static_cast<U16>(32768 - quadrant) : quadrant;
    phase[x] = s[x] < 0 ? static_cast<U16>(-half) : half;
    const U16 length_over_most = static_cast<U16>(
        32771 + High(z, static_cast<U16>(16286 - High(z, static_cast<U16>(3515 - High(z, 802))))));
    modulation[x] = High(static_cast<U16>(most[x] << 6), length_over_most);
  }
}

FORGESCAN_INLINE void FindOrder(const PackedConstants& k, int length, Work& w) {
  const U16* const base = w.phase[k.slot[0]].data();
  for (int o = 0; o < 2; ++o) {
    const U16* const phase = w.phase[k.slot[o + 1]].data();
    const U16 ratio = k.ratio_high[o];
    U16* const difference = reinterpret_cast<U16*>(w.off[o].data());
    for (int x = 0; x < length; ++x) {
      difference[x] = static_cast<U16>(phase[x] - High(base[x], ratio));
    }
  }
  const I16 *const r1 = w.off[0].data(), *const r2 = w.off[1].data();
  for (int x = 0; x < length; ++x) {
    w.cell[x] = static_cast<I32>(((static_cast<U32>(static_cast<U16>(r2[x])) & 0xFF80U) << 2) |
                                 (static_cast<U32>(static_cast<U16>(r1[x])) >> 7));
  }
  const U32* const cells = k.cells;
  for (int x = 0; x < length; ++x) {
    w.order[x] = static_cast<U16>(cells[w.cell[x]]);
  }
}

FORGESCAN_INLINE void Fuse(const PackedConstants& k, const PackedStrip& strip, Work& w) {
  for (int o = 0; o < 2; ++o) {
    const U16 high = k.ratio_high[o], low = k.ratio_low[o], first = k.first_turns[o];
    I16* const off = w.off[o].data();
    for (int x = 0; x < strip.length; ++x) {
      const U16 order = w.order[x] & 0x7FFF;
      off[x] = static_cast<I16>(
          static_cast<U16>(order * high + High(order, low) + first - static_cast<U16>(off[x])));
    }
  }
  const U16* const base = w.phase[k.slot[0]].data();
  const I16 *const off1 = w.off[0].data(), *const off2 = w.off[1].data();
  const float period = k.period_px, start = k.first_order_px, gain1 = k.gain_px[0], gain2 = k.gain_px[1];
  float* const coordinate = strip.coordinate_px;
  for (int x = 0; x < strip.length; ++x) {
    const I32 steps = ((w.order[x] & 0x7FFF) << 16) | base[x];
    coordinate[x] = (static_cast<float>(steps) * period + start) -
                    (static_cast<float>(off1[x]) * gain1 + static_cast<float>(off2[x]) * gain2);
  }
}

FORGESCAN_INLINE void CompareModulations(const PackedConstants& k, int length, Work& w) {
  const U16* const first = w.modulation[k.first_slot].data();
  for (int x = 0; x < length; ++x) {
    w.least[x] = Lesser(w.modulation[0][x], Lesser(w.modulation[1][x], w.modulation[2][x]));
    U16 excess = 0, quiet = 65535;
    for (int j = 0; j < 3; ++j) {
      const U16 wanted = High(static_cast<U16>(2 * first[x]), k.ratio[j]);
      const U16 off = Distance(w.modulation[j][x], wanted), allowed = High(wanted, k.ratio_tolerance);
      excess = Greater(excess, off > allowed ? static_cast<U16>(off - allowed) : 0);
      quiet = Lesser(quiet, High(w.modulation[j][x], k.quietness[j]));
    }
    w.excess[x] = excess;
    w.quiet[x] = quiet;
  }
}

FORGESCAN_INLINE void CompareReference(const PackedConstants& k, const PackedStrip& strip, Work& w) {
  const U16* const modulation = w.modulation[k.first_slot].data();
  const std::uint8_t* const white = k.has_reference ? strip.frames[7] : strip.frames[0];
  constexpr U16 kFullScale = 255 * 64;
  for (int x = 0; x < strip.length; ++x) {
    const U16 wanted = Lesser(static_cast<U16>(32 * w.level[x] + High(static_cast<U16>(2 * modulation[x]),
                                                                      k.reference_per_modulation)),
                              kFullScale);
    const U16 off = Distance(static_cast<U16>(64 * white[x]), wanted);
    w.white[x] = wanted;
    w.white_off[x] = k.has_reference && off > High(modulation[x], k.reference_tolerance) ? off : 0;
  }
}

// The cause of each pixel, without a branch: the last one that applies wins, so their order is MaskCause's,
// backwards.
FORGESCAN_INLINE bool Classify(const PackedConstants& k, const PackedStrip& strip, const Work& w) {
  const I16 *const off1 = w.off[0].data(), *const off2 = w.off[1].data();
  I32 doubts = 0;
  for (int x = 0; x < strip.length; ++x) {
    const auto mark = [](I32 cause, bool applies, MaskCause other) {
      return applies ? static_cast<I32>(other) : cause;
    };
    const U32 disagreement = static_cast<U32>(off1[x] * off1[x]) + static_cast<U32>(off2[x] * off2[x]);
    const float level = w.level[x], white = w.white[x], white_off = w.white_off[x], excess = w.excess[x];
    const float quiet = w.quiet[x], least = w.least[x], coordinate = strip.coordinate_px[x];
    const float variance = k.grey_variance + k.grey_variance_per_level * level;
    const float white_variance = k.reference_variance + (k.reference_variance_per_level * level +
                                                         k.reference_variance_per_white * white);
    I32 cause = mark(0, disagreement > k.max_disagreement, MaskCause::kDisagreement);
    cause = mark(cause, (w.order[x] & 0x8000) != 0, MaskCause::kUnwrapMargin);
    cause = mark(cause, coordinate < k.first_px, MaskCause::kOutOfRange);
    cause = mark(cause, coordinate > k.last_px, MaskCause::kOutOfRange);
    cause = mark(cause, white_off * white_off > white_variance, MaskCause::kReference);
    cause = mark(cause, excess * excess > k.ratio_variances * variance, MaskCause::kModulationRatio);
    cause = mark(cause, quiet * quiet < k.noise_variances * variance, MaskCause::kNoisy);
    cause = mark(cause, least * least < k.low_variances * variance, MaskCause::kLowModulation);
    cause = mark(cause, w.least[x] < k.min_modulation, MaskCause::kLowModulation);
    cause = mark(cause, w.peak[x] >= k.saturation_dn, MaskCause::kSaturated);
    doubts |= cause == static_cast<I32>(MaskCause::kUnwrapMargin) ? 1 : 0;
    strip.cause[x] = static_cast<std::uint8_t>(cause);
  }
  return doubts != 0;
}

// Cosine and sine of a slot's phase times its influence, in place of c and s. 1 / sqrt(1 + z): minimax, error
// 4e-4.
FORGESCAN_INLINE void FindInfluence(const PackedConstants& k, int length, int slot, Work& w) {
  I16 *const c = w.c[slot].data(), *const s = w.s[slot].data();
  const U16* const slope = w.slope[slot].data();
  const U16 influence = static_cast<U16>(k.influence[slot]);
  for (int x = 0; x < length; ++x) {
    const U16 q = slope[x], z = High(q, q);
    const U16 inverse = static_cast<U16>(
        65508 - High(z, static_cast<U16>(31748 - High(z, static_cast<U16>(18242 - High(z, 5688))))));
    const U16 greater = High(inverse, influence), lesser = High(greater, q);
    const bool swap = Magnitude(s[x]) > Magnitude(c[x]);
    const I16 along = static_cast<I16>(swap ? lesser : greater),
              across = static_cast<I16>(swap ? greater : lesser);
    c[x] = c[x] < 0 ? static_cast<I16>(-along) : along;
    s[x] = s[x] < 0 ? static_cast<I16>(-across) : across;
  }
}

// How a change n of a frame changes the coordinate, to first order, in units of its largest possible sum: I11
// and I13 through their own phase and through the background of all, the others through their own phase.
FORGESCAN_INLINE void SumInfluences(const PackedStrip& strip, Work& w) {
  const auto& f = strip.frames;
  for (int x = 0; x < strip.length; ++x) {
    const I16 c0 = w.c[0][x], s0 = w.s[0][x], c1 = w.c[1][x], s1 = w.s[1][x], c2 = w.c[2][x], s2 = w.s[2][x];
    const I16 all = static_cast<I16>(c0 + c1 + s1 + c2 + s2);
    const std::array<U16, 7> square = {Square(static_cast<I16>((all - s0) >> 1)),
                                       Square(c0),
                                       Square(static_cast<I16>((all + s0) >> 1)),
                                       Square(s1),
                                       Square(c1),
                                       Square(s2),
                                       Square(c2)};
    U16 sum = 0, lit = 0;
    for (int i = 0; i < 7; ++i) {
      sum = static_cast<U16>(sum + square[i]);
      lit = static_cast<U16>(lit + High(square[i], static_cast<U16>(f[i][x] << 8)));
    }
    w.squares[x] = sum;
    w.lit_squares[x] = lit;
  }
}

// 1 / sqrt(x) by the halved exponent and two steps of Newton's; relative error below 1e-5.
FORGESCAN_INLINE float InverseRoot(float x) {
  float y = std::bit_cast<float>(0x5f375a86 - (std::bit_cast<I32>(x) >> 1));
  const float half = 0.5f * x;
  y = y * (1.5f - half * y * y);
  return y * (1.5f - half * y * y);
}

FORGESCAN_INLINE void PredictSigma(const PackedConstants& k, const PackedStrip& strip, Work& w) {
  for (int j = 0; j < 3; ++j) {
    FindInfluence(k, strip.length, j, w);
  }
  SumInfluences(strip, w);
  const U16 r0 = k.mean_ratio[0], r1 = k.mean_ratio[1], r2 = k.mean_ratio[2];
  const float read = k.read_variance, lit = k.lit_variance, scale = k.sigma_scale_px;
  float* const sigma = strip.sigma_px;
  for (int x = 0; x < strip.length; ++x) {
    const U16 mean = static_cast<U16>(High(w.modulation[0][x], r0) + High(w.modulation[1][x], r1) +
                                      High(w.modulation[2][x], r2));
    const float modulation = mean;
    const float variance = read * w.squares[x] + lit * w.lit_squares[x];
    sigma[x] = scale * variance * InverseRoot(variance * (modulation * modulation));
  }
}

FORGESCAN_INLINE bool DecodeStrip(const PackedConstants& k, const PackedStrip& strip) {
  if (strip.length % 32 != 0) {
    __builtin_unreachable();
  }
  Work w;
  LoadThree(strip, w);
  LoadTwo(strip, 1, w);
  LoadTwo(strip, 2, w);
  FindPeak(strip, w);
  FindSlopes(strip.length, w);
  for (int j = 0; j < 3; ++j) {
    FindPhase(strip.length, j, w);
  }
  FindOrder(k, strip.length, w);
  Fuse(k, strip, w);
  CompareModulations(k, strip.length, w);
  CompareReference(k, strip, w);
  const bool doubts = Classify(k, strip, w);
  PredictSigma(k, strip, w);
  return doubts;
}

bool DecodeBaseline(const PackedConstants& k, const PackedStrip& strip) { return DecodeStrip(k, strip); }

#if defined(__x86_64__)
[[gnu::target("avx2,prefer-vector-width=256")]] bool DecodeAvx2(const PackedConstants& k,
                                                                const PackedStrip& strip) {
  return DecodeStrip(k, strip);
}
[[gnu::target("avx512f,avx512bw,avx512vl,avx512dq,prefer-vector-width=512")]] bool DecodeAvx512(
    const PackedConstants& k, const PackedStrip& strip) {
  return DecodeStrip(k, strip);
}
#endif

}  // namespace

PackedKernel::PackedKernel(SimdPath path) : run_(&DecodeBaseline) {
#if defined(__x86_64__)
  run_ = path == SimdPath::kAvx512 ? &DecodeAvx512 : path == SimdPath::kAvx2 ? &DecodeAvx2 : run_;
#endif
}

}  // namespace forgescan
