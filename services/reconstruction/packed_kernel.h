// The arithmetic of the shared 3-2-2 set on 8-bit frames in packed 16-bit lanes, for each kind of vector
// instructions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "services/common/simd_path.h"

namespace forgescan {

// A limit that grows with the noise of light: base + per_level / 2^9 for each unit of 2 A, DN.
struct PackedLimit {
  std::uint16_t base = 0;
  std::uint16_t per_level = 0;
};

// Eq. (4) of the paper as whole numbers: 2 A = I11 + I13, 2 C1 = I11 - I13, 2 S1 = 2 A - 2 I12, 2 Cj = 2 Ij1
// - 2 A, 2 Sj = 2 A - 2 Ij2. Slot 0 is the frequency with three frames. Units: a phase is 2^-16 turn, a
// modulation or contrast 1/64 DN. A phase is within 1.5e-4 rad of the exact one, a hundredth of the noise of
// good light; a modulation within 1/1500 and 1/32 DN.
struct PackedConstants {
  std::array<std::size_t, 3> slot{};  // of the finest frequency and of the other two
  std::size_t first_slot = 0;         // of the pattern's first frequency, which ratios and reference refer to
  bool has_reference = false;

  // 256 x 256 in squares of 8 x 8: fringe order less the first one; bit 7: doubtful. The index has, from its
  // highest bit, 5 bits of the second code, 5 of the first, the next 3 of the second, the next 3 of the
  // first.
  const std::uint8_t* cells = nullptr;
  std::array<std::uint16_t, 2> ratio_high{};   // of the others' periods, 2^-16
  std::array<std::uint16_t, 2> ratio_low{};    // 2^-32
  std::array<std::uint16_t, 2> first_turns{};  // code of the first order
  float period_px = 0;                         // finest period, over 2^16
  float first_order_px = 0;                    // where the first order begins
  std::array<std::int16_t, 2> gain{};          // of the coordinate per 2^-16 turn of the others' disagreement
  float gain_px = 0;                           // unit of gain
  std::uint16_t max_disagreement = 0;          // sum of the squares, 2^-16 turn^2
  float first_px = 0;
  float last_px = 0;

  std::uint8_t lit_across_dn =
      0;  // 2 C and S of slot 0: a pixel that is below both has less than min_modulation
  std::uint8_t lit_along_dn = 0;
  std::uint8_t saturation_dn = 255;
  std::uint16_t min_modulation = 0;
  PackedLimit variance;                        // of a grey value, in units that use 15 bits
  std::uint16_t low_limit = 0;                 // 2^-16 of variance: of the least modulation, squared, >> 8
  std::uint16_t noise_limit = 0;               // of the least modulation scaled by quietness, squared, >> 12
  std::uint16_t ratio_limit = 0;               // of the excess of a ratio, squared, >> 8
  std::array<std::uint16_t, 2> quietness{};    // 2^-16: least phase noise over that of slot 0, of the others
  std::array<std::size_t, 2> compared_slot{};  // those that are not first_slot
  std::array<std::uint16_t, 2> ratio_least{};  // 2^-15: modulation over the first slot's
  std::array<std::uint16_t, 2> ratio_most{};   // 2^-15

  std::uint16_t reference_per_modulation = 0;  // 2^-15
  std::uint16_t reference_tolerance = 0;       // 2^-16 of the modulation
  PackedLimit white_limit;                     // of what the reference is off, squared, >> 8
  std::uint16_t white_limit_per_white = 0;     // 2^-14, per 1/64 DN expected

  // For each order and 64 phases of the finest frequency, two signed factors: what the noise all light has
  // and what the fringes add to it contribute to a coordinate's variance.
  const std::uint32_t* factors = nullptr;
  float variance_scale_px2 = 0;
  std::array<std::uint16_t, 3> mean_ratio{};  // 2^-16: brings the slots' modulations to a mean one
};

struct PackedStrip {
  std::array<const std::uint8_t*, 8> frames{};  // I11 I12 I13 I21 I22 I31 I32 and the reference, or nothing
  int length = 0;                               // px: a multiple of 32, at most kMaxLength
  float* coordinate_px = nullptr;               // NaN where masked, but for pixels of doubtful fringe order
  std::uint16_t* variance_px2 = nullptr;        // upper half of a float; null: not wanted
  std::uint8_t* cause = nullptr;

  // The rest of it from a pixel on.
  PackedStrip From(int begin) const {
    PackedStrip rest = *this;
    for (const std::uint8_t*& frame : rest.frames) {
      frame = frame == nullptr ? frame : frame + begin;
    }
    rest.length -= begin;
    rest.coordinate_px += begin;
    rest.variance_px2 = variance_px2 == nullptr ? nullptr : variance_px2 + begin;
    rest.cause += begin;
    return rest;
  }
};

class PackedKernel {
 public:
  static constexpr int kMaxLength = 512;
  static constexpr int kBlock = 32;  // pixels that are decoded or, for want of contrast, not decoded together
  static constexpr int kMaxOrders = 128;

  explicit PackedKernel(SimdPath path);

  // Whether any pixel is masked because its fringe order is doubtful.
  bool Decode(const PackedConstants& constants, const PackedStrip& strip) const {
    return run_(constants, strip);
  }

 private:
  bool (*run_)(const PackedConstants&, const PackedStrip&);
};

}  // namespace forgescan
