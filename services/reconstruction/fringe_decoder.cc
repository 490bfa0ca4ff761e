#include "services/reconstruction/fringe_decoder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/clipping.h"
#include "services/reconstruction/fringe_order_repair.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/mask_border.h"
#include "services/reconstruction/pixel_sampler.h"
#include "services/reconstruction/strip_decoder.h"

namespace forgescan {
namespace {

constexpr double kFullScaleDn = 255;
constexpr double kRounding = 1e-5;  // of a grey value scaled in single precision

// By the plain arithmetic. Returns whether the row has pixels of doubtful order.
bool DecodeRow(std::span<const cv::Mat> frames, int row, StripDecoder& strip, DecodedView& view) {
  constexpr auto kValid = static_cast<std::int32_t>(MaskCause::kValid);
  constexpr auto kDoubtful = static_cast<std::int32_t>(MaskCause::kUnwrapMargin);
  bool doubts = false;
  for (int column = 0; column < view.cause.cols; column += StripDecoder::kLength) {
    const int length = std::min(StripDecoder::kLength, view.cause.cols - column);
    strip.Load(frames, row, column, length);
    strip.Decode();
    std::transform(strip.coordinate_px.begin(), strip.coordinate_px.begin() + length, strip.cause.begin(),
                   view.coordinate_px[row] + column, [](float coordinate_px, std::int32_t cause) {
                     const bool may_be_valid = cause == kValid || cause == kDoubtful;
                     return may_be_valid ? coordinate_px : std::numeric_limits<float>::quiet_NaN();
                   });
    if (row % 2 == 0) {
      std::transform(strip.sigma_px.begin(), strip.sigma_px.begin() + length,
                     view.variance_px2[row / 2] + column,
                     [](float sigma_px) { return UpperOfFloat(sigma_px * sigma_px); });
    }
    std::transform(strip.cause.begin(), strip.cause.begin() + length, view.cause[row] + column,
                   [](std::int32_t cause) { return static_cast<std::uint8_t>(cause); });
    doubts = std::find(strip.cause.begin(), strip.cause.begin() + length, kDoubtful) !=
                 strip.cause.begin() + length ||
             doubts;
  }
  return doubts;
}

void TakeMedians(std::span<const cv::Mat> frames, const FringeDecoder& decoder, double scale,
                 DecodedView& view) {
  HistogramMedian modulation(0, 256, 4096);
  HistogramMedian sigma(0, 2, 4000);
  PixelSampler sampler(frames, decoder.estimator(), scale);
  const int step = 2 * SamplingStep(view.cause.size());  // 5000 are plenty for a median
  // Even rows, for their variances.
  const int first = step / 2 & ~1;
  for (int row = first; row < view.cause.rows; row += step) {
    for (int column = step / 2; column < view.cause.cols; column += step) {
      if (view.cause(row, column) == static_cast<std::uint8_t>(MaskCause::kValid)) {
        modulation.Add(sampler.LeastModulation(row, column));
        sigma.Add(static_cast<double>(view.SigmaPx(row, column)));
      }
    }
  }
  if (modulation.total() > 0) {
    view.median_modulation_dn = modulation.Median();
    view.median_sigma_px = sigma.Median();
  }
}

}  // namespace

Status CheckFrames(std::span<const cv::Mat> frames, int count) {
  if (static_cast<int>(frames.size()) != count) {
    return Fail(ErrorCode::kInvalidArgument, "the view has {} frames, the pattern set {}", frames.size(),
                count);
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].empty() || (frames[i].type() != CV_8UC1 && frames[i].type() != CV_16UC1)) {
      return Fail(ErrorCode::kInvalidArgument, "frame {} is not a grey image of 8 or 16 bit", i + 1);
    }
    if (frames[i].size() != frames[0].size() || frames[i].type() != frames[0].type()) {
      return Fail(ErrorCode::kInvalidArgument,
                  "frame {} has {} x {} px of {} bit, the first one {} x {} of {} bit", i + 1, frames[i].cols,
                  frames[i].rows, 8 * frames[i].elemSize(), frames[0].cols, frames[0].rows,
                  8 * frames[0].elemSize());
    }
  }
  return {};
}

double GreyScale(const cv::Mat& frame, const ReconstructionConfig& config) {
  return frame.depth() == CV_8U ? 1 : kFullScaleDn / config.full_scale_16bit_dn;
}

Result<FringeDecoder> FringeDecoder::Create(PatternSet pattern, const ReconstructionConfig& config,
                                            std::optional<SimdPath> path) {
  RETURN_IF_ERROR(Check(config));
  FringeDecoder decoder;
  ASSIGN_OR_RETURN(decoder.estimator_, MakePhaseEstimator(pattern));
  ASSIGN_OR_RETURN(decoder.table_, MakeFringeOrderTable(pattern, config.min_unwrap_margin_fraction,
                                                        config.dead_margin_fraction));
  decoder.config_ = config;
  decoder.pattern_ = std::move(pattern);
  if (path) {
    decoder.packed_ =
        PackedDecoder::Make({decoder.pattern_, config, decoder.estimator_, decoder.table_}, *path);
  }
  return decoder;
}

std::vector<std::uint8_t> FringeDecoder::DecodeRows(std::span<const cv::Mat> frames,
                                                    const ReconstructionConfig& config, MaskMap& masked,
                                                    DecodedView& view) const {
  std::vector<std::uint8_t> doubtful(static_cast<std::size_t>(view.cause.rows));
  const bool packed = packed_ && frames[0].depth() == CV_8U && view.cause.cols >= PackedDecoder::kMinWidthPx;
  const int saturation_dn = static_cast<int>(std::ceil(config.saturation_fraction * kFullScaleDn));
  ParallelRows(config.threads, view.cause.rows, [&](int begin, int end) {
    const auto strip =
        packed ? nullptr : std::make_unique<StripDecoder>(pattern_, config, estimator_, table_);
    for (int row = begin; row < end; ++row) {
      doubtful[static_cast<std::size_t>(row)] =
          packed ? packed_->Row(frames, row, saturation_dn, view) : DecodeRow(frames, row, *strip, view);
      masked.SetRow(row, view.cause[row]);
    }
  });
  return doubtful;
}

Result<DecodedView> FringeDecoder::Decode(std::span<const cv::Mat> frames) const {
  RETURN_IF_ERROR(CheckFrames(frames, pattern_.frame_count()));
  DecodedView view = pool_->Take(frames[0].size());
  ReconstructionConfig config = config_;
  if (const auto level = FindClippingLevel(frames, pattern_, config_.threads)) {
    const double clipping_dn = GreyScale(frames[0], config_) * *level;
    if (clipping_dn < kFullScaleDn) {
      view.clipping_dn = clipping_dn;
      config.saturation_fraction =
          std::min(config.saturation_fraction, (1 - kRounding) * clipping_dn / kFullScaleDn);
    }
  }
  MaskMap masked(view.cause.size());
  const std::vector<std::uint8_t> doubtful = DecodeRows(frames, config, masked, view);
  const double period_px = pattern_.frequencies[static_cast<std::size_t>(table_.base)].period_px;
  view.repaired = RepairFringeOrders(doubtful, period_px, config_, masked, view);
  DropMaskBorder(config_, masked, view);
  TakeMedians(frames, *this, GreyScale(frames[0], config_), view);
  return view;
}

}  // namespace forgescan
