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

// Widens the masks of a block of rows, from a copy of the rows around it as they were before.
class BlockBorder {
 public:
  BlockBorder(int radius_px, int width_px, SimdPath path)
      : kernel_(path),
        radius_(radius_px),
        width_(static_cast<std::size_t>(width_px)),
        padded_(width_ + 2 * static_cast<std::size_t>(radius_px)),
        ring_(2 * static_cast<std::size_t>(radius_px) + 1, std::vector<std::uint8_t>(width_)),
        near_(width_) {}

  // before: the rows as they were; a row beyond the image is nullptr. rows: [begin, end).
  void Run(const std::function<const std::uint8_t*(int)>& before, int begin, int end,
           cv::Mat_<std::uint8_t>& cause) {
    for (int row = begin - radius_; row < begin + radius_; ++row) {
      WidenRow(before(row), row);
    }
    for (int row = begin; row < end; ++row) {
      WidenRow(before(row + radius_), row + radius_);
      Mark(cause[row]);
    }
  }

 private:
  std::vector<std::uint8_t>& Slot(int row) {
    const int slots = 2 * radius_ + 1;
    return ring_[static_cast<std::size_t>((row + slots) % slots)];
  }

  void WidenRow(const std::uint8_t* cause, int row) {
    std::vector<std::uint8_t>& wide = Slot(row);
    if (cause == nullptr) {
      std::fill(wide.begin(), wide.end(), std::uint8_t{0});
      return;
    }
    std::copy_n(cause, width_, padded_.begin() + radius_);
    kernel_.Widen(padded_, 2 * radius_, wide);
  }

  void Mark(std::uint8_t* cause) {
    near_ = ring_[0];
    for (std::size_t slot = 1; slot < ring_.size(); ++slot) {
      kernel_.Join(ring_[slot], near_);
    }
    kernel_.Mark(near_, kBorder, {cause, width_});
  }

  MaskKernel kernel_;
  int radius_;
  std::size_t width_;
  std::vector<std::uint8_t> padded_;
  std::vector<std::vector<std::uint8_t>> ring_;
  std::vector<std::uint8_t> near_;
};

// Causes come in long runs: eight at a time where they are equal.
void CountRow(const std::uint8_t* cause, int width, Counts& counts) {
  int x = 0;
  for (; x + 8 <= width; x += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, cause + x, 8);
    if (eight == std::rotl(eight, 8)) {
      counts[cause[x]] += 8;
    } else {
      std::for_each_n(cause + x, 8, [&](std::uint8_t one) { ++counts[one]; });
    }
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
