// One camera's frames -> absolute projector coordinate of every pixel.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "services/common/result.h"
#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/fringe_order_table.h"
#include "services/reconstruction/mask_map.h"
#include "services/reconstruction/packed_decoder.h"
#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/phase_estimator.h"
#include "services/reconstruction/reconstruction_config.h"
#include "services/reconstruction/view_pool.h"

namespace forgescan {

// Everything that depends on the pattern and the thresholds only; made once, used for every view, from any
// thread.
class FringeDecoder {
 public:
  // path: vector instructions to use where PackedDecoder can do the set; nothing = never use it, the plain
  // arithmetic is the tests' reference. Errors: those of Check(config), MakePhaseEstimator and
  // MakeFringeOrderTable.
  static Result<FringeDecoder> Create(PatternSet pattern, const ReconstructionConfig& config,
                                      std::optional<SimdPath> path = BestSimdPath());

  // Shape: pattern.frame_count() frames in order of frame_index, all of one size, CV_8UC1 or CV_16UC1.
  // Errors: kInvalidArgument for a wrong number, size or type of frames. A view without one valid pixel is a
  // result. Cost: tests/bench/decode_bench.cc.
  Result<DecodedView> Decode(std::span<const cv::Mat> frames) const;

  // Takes back a view that is no longer needed; the next one is decoded into its maps.
  void Recycle(DecodedView view) const { pool_->Give(std::move(view)); }

  const PatternSet& pattern() const { return pattern_; }
  const PhaseEstimator& estimator() const { return estimator_; }
  const FringeOrderTable& table() const { return table_; }
  bool is_packed() const { return packed_.has_value(); }  // for frames of 8 bit

 private:
  FringeDecoder() = default;
  // Before any repair. Returns which rows have pixels of doubtful order.
  std::vector<std::uint8_t> DecodeRows(std::span<const cv::Mat> frames, const ReconstructionConfig& config,
                                       MaskMap& masked, DecodedView& view) const;

  PatternSet pattern_;
  ReconstructionConfig config_;
  PhaseEstimator estimator_;
  FringeOrderTable table_;
  std::shared_ptr<ViewPool> pool_ = std::make_shared<ViewPool>();
  std::optional<PackedDecoder> packed_;
};

// Errors: kInvalidArgument unless frames are count non-empty images of one size and type, CV_8UC1 or
// CV_16UC1.
Status CheckFrames(std::span<const cv::Mat> frames, int count);

// Factor that brings a frame's grey values to 8-bit DN.
double GreyScale(const cv::Mat& frame, const ReconstructionConfig& config);

}  // namespace forgescan
