// The absolute projector coordinate of every pixel of one camera, and why the others have none.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string_view>

namespace forgescan {

// Why a pixel was left out; the first cause that applies, in this order.
enum class MaskCause : std::uint8_t {
  kValid,
  kSaturated,  // or where the camera cuts off its grey values
  kLowModulation,
  kNoisy,            // predicted phase sigma too large
  kModulationRatio,  // the frequencies' modulations do not fit together: a disturbed frame or background
  kReference,        // the reference frame does not fit
  kOutOfRange,       // outside the projector's field, or where fringe orders wrap
  kUnwrapMargin,     // the fringe order is doubtful, and its neighbourhood could not repair it
  kDisagreement,     // the frequencies disagree
  kBorder,           // next to a masked pixel
};
constexpr int kMaskCauses = 10;

constexpr std::string_view NameOf(MaskCause cause) {
  constexpr std::array<std::string_view, kMaskCauses> kNames = {
      "valid",     "saturated",    "low_modulation", "noisy",        "modulation_ratio",
      "reference", "out_of_range", "unwrap_margin",  "disagreement", "border"};
  return kNames[static_cast<std::size_t>(cause)];
}

// A float by its upper 16 bits, sign, exponent and 7 bits: to 0.4 %, rounded.
inline float FloatFromUpper(std::uint16_t upper) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(upper) << 16);
}
inline std::uint16_t UpperOfFloat(float value) {
  return static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(value) + 0x8000U) >> 16);
}

// Shape: coordinate_px and cause have the size of the frames. Frames: raw camera pixels.
struct DecodedView {
  cv::Mat_<float> coordinate_px;  // projector column; NaN where masked
  // Its predicted variance, projector px^2, by FloatFromUpper: of even rows only, so half as many rows.
  // Fringes run across the rows, so the row below has nearly the same. Anything where that pixel of the even
  // row is masked.
  cv::Mat_<std::uint16_t> variance_px2;
  cv::Mat_<std::uint8_t> cause;  // MaskCause
  float VariancePx2(int row, int column) const { return FloatFromUpper(variance_px2(row / 2, column)); }
  float SigmaPx(int row, int column) const { return std::sqrt(VariancePx2(row, column)); }
  std::array<long, kMaskCauses> count{};  // pixels by cause; their sum is the image
  long repaired = 0;  // valid pixels whose fringe order was doubtful and came from their neighbours
  std::optional<double> clipping_dn;  // where the camera cut off the fringes, if below full scale
  double median_modulation_dn = 0;    // the least B of the frequencies, over valid pixels of a regular grid
  double median_sigma_px = 0;         // over the same pixels
};

}  // namespace forgescan
