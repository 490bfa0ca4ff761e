#include "services/reconstruction/fringe_decoder.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/clipping.h"
#include "services/reconstruction/fringe_order_repair.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/strip_decoder.h"

namespace forgescan {
namespace {

constexpr double kFullScaleDn = 255;
constexpr double kRounding = 1e-5;  // of a grey value scaled in single precision

DecodedView MakeView(cv::Size size) {
  DecodedView view;
  view.coordinate_px.create(size);
  view.sigma_px.create(size);
  view.modulation_dn.create(size);
  view.disagreement_rad.create(size);
  view.cause.create(size);
  return view;
}

void Store(const StripDecoder& strip, int row, int column, int length, DecodedView& view) {
  std::copy_n(strip.coordinate_px.begin(), length, view.coordinate_px[row] + column);
  std::copy_n(strip.sigma_px.begin(), length, view.sigma_px[row] + column);
  std::copy_n(strip.modulation_dn.begin(), length, view.modulation_dn[row] + column);
  std::copy_n(strip.disagreement_rad.begin(), length, view.disagreement_rad[row] + column);
  std::uint8_t* const cause = view.cause[row] + column;
  for (int x = 0; x < length; ++x) {
    cause[x] = static_cast<std::uint8_t>(strip.cause[static_cast<std::size_t>(x)]);
  }
}

void CountCauses(int threads, DecodedView& view) {
  std::vector<std::array<long, kMaskCauses>> rows(static_cast<std::size_t>(view.cause.rows));
  ParallelRows(threads, view.cause.rows, [&](int begin, int end) {
    for (int row = begin; row < end; ++row) {
      const std::uint8_t* const cause = view.cause[row];
      for (int column = 0; column < view.cause.cols; ++column) {
        ++rows[static_cast<std::size_t>(row)][cause[column]];
      }
    }
  });
  for (const auto& row : rows) {
    std::transform(row.begin(), row.end(), view.count.begin(), view.count.begin(), std::plus<>());
  }
}

void TakeMedians(DecodedView& view) {
  constexpr int kRowStep = 8;  // every eighth row is plenty for a median
  HistogramMedian modulation(0, 256, 4096);
  HistogramMedian sigma(0, 2, 4000);
  for (int row = kRowStep / 2; row < view.cause.rows; row += kRowStep) {
    for (int column = 0; column < view.cause.cols; ++column) {
      if (view.cause(row, column) == static_cast<std::uint8_t>(MaskCause::kValid)) {
        modulation.Add(static_cast<double>(view.modulation_dn(row, column)));
        sigma.Add(static_cast<double>(view.sigma_px(row, column)));
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

Result<FringeDecoder> FringeDecoder::Create(PatternSet pattern, const ReconstructionConfig& config) {
  RETURN_IF_ERROR(Check(config));
  FringeDecoder decoder;
  ASSIGN_OR_RETURN(decoder.estimator_, MakePhaseEstimator(pattern));
  ASSIGN_OR_RETURN(decoder.table_, MakeFringeOrderTable(pattern, config.min_unwrap_margin_fraction,
                                                        config.dead_margin_fraction));
  decoder.config_ = config;
  decoder.pattern_ = std::move(pattern);
  return decoder;
}

Result<DecodedView> FringeDecoder::Decode(std::span<const cv::Mat> frames) const {
  RETURN_IF_ERROR(CheckFrames(frames, pattern_.frame_count()));
  const cv::Size size = frames[0].size();
  DecodedView view = MakeView(size);
  ReconstructionConfig config = config_;
  if (const auto level = FindClippingLevel(frames, pattern_, config_.threads)) {
    const double clipping_dn = GreyScale(frames[0], config_) * *level;
    if (clipping_dn < config_.saturation_fraction * kFullScaleDn) {
      view.clipping_dn = clipping_dn;
      config.saturation_fraction = (1 - kRounding) * clipping_dn / kFullScaleDn;
    }
  }
  ParallelRows(config_.threads, size.height, [&](int begin, int end) {
    const auto strip = std::make_unique<StripDecoder>(pattern_, config, estimator_, table_);
    for (int row = begin; row < end; ++row) {
      for (int column = 0; column < size.width; column += StripDecoder::kLength) {
        const int length = std::min(StripDecoder::kLength, size.width - column);
        strip->Load(frames, row, column, length);
        strip->Decode();
        Store(*strip, row, column, length, view);
      }
    }
  });
  view.repaired = RepairFringeOrders(
      view, pattern_.frequencies[static_cast<std::size_t>(table_.base)].period_px, config_);
  DropMaskBorder(view, config_);
  CountCauses(config_.threads, view);
  TakeMedians(view);
  return view;
}

}  // namespace forgescan
