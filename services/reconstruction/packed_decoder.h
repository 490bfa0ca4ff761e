// The fast way to decode: the paper's shared 3-2-2 set on 8-bit frames, see packed_kernel.h.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/fringe_order_table.h"
#include "services/reconstruction/packed_kernel.h"
#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/phase_estimator.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

class PackedDecoder {
 public:
  static constexpr int kMinWidthPx = 32;

  struct Set {
    const PatternSet& pattern;
    const ReconstructionConfig& config;
    const PhaseEstimator& estimator;
    const FringeOrderTable& table;
  };
  // Nothing unless the estimator is Eq. (4) for one frequency of three frames and two of two, and the
  // thresholds are in the range of the kernel's numbers; then StripDecoder does it.
  static std::optional<PackedDecoder> Make(const Set& set, SimdPath path);

  // One row of 8-bit frames at least kMinWidthPx wide, into the maps of the view. saturation_dn: a grey value
  // that counts as saturated. Returns whether the row has pixels masked by kUnwrapMargin.
  bool Row(std::span<const cv::Mat> frames, int row, int saturation_dn, DecodedView& view) const;

 private:
  explicit PackedDecoder(SimdPath path) : kernel_(path) {}
  void SetOrders(const Set& set);
  void SetMasks(const Set& set);
  void SetReference(const Set& set);
  void SetVariance(const Set& set);

  PackedKernel kernel_;
  PackedConstants constants_;
  std::array<std::size_t, 3> frequency_{};  // of each slot
  std::array<std::size_t, 8> frame_{};      // of each frame of PackedStrip
  std::vector<std::uint8_t> cells_;
  std::vector<std::uint32_t> factors_;
};

}  // namespace forgescan
