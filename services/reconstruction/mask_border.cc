#include "services/reconstruction/mask_border.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <vector>

#include "services/common/parallel_rows.h"
#include "services/reconstruction/mask_kernel.h"

namespace forgescan {
namespace {

constexpr auto kBorder = static_cast<std::uint8_t>(MaskCause::kBorder);
constexpr int kBlockRows = 64;
using Counts = std::array<long, kMaskCauses>;

// Widens the masks of a block of rows. A row is marked only when all that look at it as it was are done.
class BlockBorder {
 public:
  BlockBorder(int radius_px, int width_px, SimdPath path)
      : kernel_(path),
        radius_(radius_px),
        width_(static_cast<std::size_t>(width_px)),
        joined_(width_ + 2 * static_cast<std::size_t>(radius_px)),
        near_(static_cast<std::size_t>(radius_px) + 1, std::vector<std::uint8_t>(width_)) {}

  // before: the rows as they were; a row beyond the image is nullptr. rows: [begin, end).
  void Run(const std::function<const std::uint8_t*(int)>& before, int begin, int end,
           cv::Mat_<std::uint8_t>& cause) {
    for (int row = begin; row < end + radius_; ++row) {
      if (row < end) {
        FindNear(before, row);
      }
      if (row - radius_ >= begin) {
        kernel_.Mark(Near(row - radius_), kBorder, {cause[row - radius_], width_});
      }
    }
  }

 private:
  std::vector<std::uint8_t>& Near(int row) { return near_[static_cast<std::size_t>(row % (radius_ + 1))]; }

  // Where the row has a masked pixel within the radius.
  void FindNear(const std::function<const std::uint8_t*(int)>& before, int row) {
    rows_.clear();
    for (int y = row - radius_; y <= row + radius_; ++y) {
      if (const std::uint8_t* const other = before(y)) {
        rows_.push_back(other);
      }
    }
    kernel_.Join(rows_, std::span(joined_).subspan(static_cast<std::size_t>(radius_), width_));
    kernel_.Widen(joined_, 2 * radius_, Near(row));
  }

  MaskKernel kernel_;
  int radius_;
  std::size_t width_;
  std::vector<const std::uint8_t*> rows_;
  std::vector<std::uint8_t> joined_;  // 0 on both sides
  std::vector<std::vector<std::uint8_t>> near_;
};

// Whether all bytes are equal.
template <int length>
bool IsUniform(const std::uint8_t* bytes) {
  std::uint64_t words[length / 8];
  std::memcpy(words, bytes, length);
  std::uint64_t differ = words[0] ^ std::rotl(words[0], 8);
  for (const std::uint64_t word : words) {
    differ |= word ^ words[0];
  }
  return differ == 0;
}

template <int length>
void CountBytes(const std::uint8_t* cause, Counts& counts) {
  if (IsUniform<length>(cause)) {
    counts[cause[0]] += length;
  } else if constexpr (length == 8) {
    std::for_each_n(cause, length, [&](std::uint8_t one) { ++counts[one]; });
  } else {
    for (int x = 0; x < length; x += 8) {
      CountBytes<8>(cause + x, counts);
    }
  }
}

// Causes come in long runs.
void CountRow(const std::uint8_t* cause, int width, Counts& counts) {
  constexpr int kRun = 64;
  int x = 0;
  for (; x + kRun <= width; x += kRun) {
    CountBytes<kRun>(cause + x, counts);
  }
  for (; x < width; ++x) {
    ++counts[cause[x]];
  }
}

// The rows a block needs from its neighbours, which may be at work on them.
struct Edges {
  Edges(const cv::Mat_<std::uint8_t>& cause, int radius) : radius_(radius) {
    for (int begin = kBlockRows; begin < cause.rows; begin += kBlockRows) {
      rows_.push_back(
          cause.rowRange(std::max(begin - radius, 0), std::min(begin + radius, cause.rows)).clone());
    }
  }
  // edge: begin of the block below it.
  const std::uint8_t* Row(int edge, int row) const {
    const cv::Mat_<std::uint8_t>& rows = rows_[static_cast<std::size_t>(edge / kBlockRows - 1)];
    return rows[row - std::max(edge - radius_, 0)];
  }

 private:
  int radius_;
  std::vector<cv::Mat_<std::uint8_t>> rows_;
};

}  // namespace

void DropMaskBorder(const ReconstructionConfig& config, SimdPath path, DecodedView& view) {
  cv::Mat_<std::uint8_t>& cause = view.cause;
  const int radius = config.mask_border_px;
  const Edges edges(cause, radius);
  const int blocks = (cause.rows + kBlockRows - 1) / kBlockRows;
  std::vector<Counts> counts(static_cast<std::size_t>(blocks), Counts{});
  ParallelRows(config.threads, blocks, [&](int first, int last) {
    BlockBorder border(radius, cause.cols, path);
    for (int block = first; block < last; ++block) {
      const int begin = block * kBlockRows, end = std::min(begin + kBlockRows, cause.rows);
      const auto before = [&](int row) -> const std::uint8_t* {
        if (row < 0 || row >= cause.rows) return nullptr;
        return row < begin ? edges.Row(begin, row) : row >= end ? edges.Row(end, row) : cause[row];
      };
      if (radius > 0) border.Run(before, begin, end, cause);
      for (int row = begin; row < end; ++row) {
        CountRow(cause[row], cause.cols, counts[static_cast<std::size_t>(block)]);
      }
    }
  });
  view.count = {};
  for (const Counts& block : counts) {
    std::transform(block.begin(), block.end(), view.count.begin(), view.count.begin(), std::plus<>());
  }
}

}  // namespace forgescan
