#include "services/reconstruction/clipping.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "services/common/parallel_rows.h"

namespace forgescan {
namespace {

template <typename Pixel>
void CountRows(const cv::Mat& frame, Histogram& histogram) {
  constexpr int kRows = 32;
  for (int row = 0; row < frame.rows; row += std::max(4, frame.rows / kRows)) {
    const Pixel* const grey = frame.ptr<Pixel>(row);
    for (int column = 0; column < frame.cols; ++column) {
      ++histogram[grey[column]];
    }
  }
}

Histogram Count(std::span<const cv::Mat> frames, const PatternSet& pattern, int threads) {
  const bool is_narrow = frames[0].depth() == CV_8U;
  const std::size_t values = is_narrow ? 256 : 65536;
  std::vector<Histogram> by_frame(frames.size(), Histogram(values));
  ParallelRows(threads, static_cast<int>(frames.size()), [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (pattern.reference_frame_index == i) {
        continue;
      }
      is_narrow ? CountRows<std::uint8_t>(frames[at], by_frame[at])
                : CountRows<std::uint16_t>(frames[at], by_frame[at]);
    }
  });
  Histogram sum(values);
  for (const Histogram& histogram : by_frame) {
    for (std::size_t value = 0; value < values; ++value) {
      sum[value] += histogram[value];
    }
  }
  return sum;
}

constexpr int kBelow = 4;  // values that occur: 12-bit frames may hold multiples of 16 only

struct Top {
  int value = -1;
  long count = 0;
  long below = 0;  // of the next kBelow values, or fewer if there are no more
  int below_count = 0;
  long total = 0;
};

Top TopOf(const Histogram& histogram) {
  Top top;
  for (int value = static_cast<int>(histogram.size()) - 1; value >= 0; --value) {
    const long count = histogram[static_cast<std::size_t>(value)];
    top.total += count;
    if (count > 0 && top.value < 0) {
      top.value = value;
      top.count = count;
    } else if (count > 0 && top.below_count < kBelow) {
      top.below += count;
      ++top.below_count;
    }
  }
  return top;
}

bool IsPile(const Top& top) {
  constexpr double kMinShare = 1e-4;
  constexpr double kMinExcess = 8;  // over the mean of the next lower values
  return top.value >= 0 && static_cast<double>(top.count) >= kMinShare * static_cast<double>(top.total) &&
         static_cast<double>(top.count) * kBelow >= kMinExcess * static_cast<double>(top.below);
}

}  // namespace

std::optional<int> FindClippingLevel(std::span<const cv::Mat> frames, const PatternSet& pattern,
                                     int threads) {
  const Top top = TopOf(Count(frames, pattern, threads));
  return top.below_count == kBelow && IsPile(top) ? std::optional(top.value) : std::nullopt;
}

std::optional<int> ReferenceClippingLevel(const Histogram& lit) {
  const Top top = TopOf(lit);
  return IsPile(top) ? std::optional(top.value) : std::nullopt;
}

}  // namespace forgescan
