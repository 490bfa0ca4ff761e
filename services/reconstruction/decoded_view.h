// The absolute projector coordinate of every pixel of one camera, and why the others have none.
#pragma once

#include <array>
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

// Shape: every map has the size of the frames. Frames: raw camera pixels.
struct DecodedView {
  cv::Mat_<float> coordinate_px;  // projector column; the estimate even where masked, so always look at cause
  cv::Mat_<float> sigma_px;       // its predicted standard deviation, projector px
  cv::Mat_<std::uint8_t> cause;   // MaskCause
  std::array<long, kMaskCauses> count{};  // pixels by cause; their sum is the image
  long repaired = 0;  // valid pixels whose fringe order was doubtful and came from their neighbours
  std::optional<double> clipping_dn;  // where the camera cut off grey values, if below saturation_fraction
  double median_modulation_dn = 0;    // the least B of the frequencies, over valid pixels of a regular grid
  double median_sigma_px = 0;         // over the same pixels
};

}  // namespace forgescan
