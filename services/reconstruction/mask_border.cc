#include "services/reconstruction/mask_border.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

#include "services/common/parallel_rows.h"

namespace forgescan {
namespace {

using Words = std::vector<std::uint64_t>;

// Words of the map with any pixel within the radius above and below, one word more at either end.
void JoinRows(const MaskMap& masked, int row, int radius, Words& joined) {
  const std::size_t length = joined.size();
  std::copy_n(masked.Row(row) - 1, length, joined.begin());
  const int last = std::min(row + radius, masked.rows() - 1);
  for (int y = std::max(row - radius, 0); y <= last; ++y) {
    const std::uint64_t* const other = masked.Row(y) - 1;
    for (std::size_t i = 0; i < length; ++i) {
      joined[i] |= other[i];
    }
  }
}

// Pixels of the middle one of three words that have one within the radius beside them.
std::uint64_t Widened(const std::uint64_t* words, int radius) {
  std::uint64_t near = words[0];
  for (int shift = 1; shift <= radius; ++shift) {
    const int rest = MaskMap::kWordPx - shift;
    near |= words[0] << shift | words[0] >> shift | words[-1] >> rest | words[1] << rest;
  }
  return near;
}

// Valid pixels of a word next to masked ones.
struct BorderWord {
  int row, column;
  std::uint64_t pixels;
};

// Finds the words of a few rows, asks for the memory they mark, and only then waits for it.
class BlockBorder {
 public:
  static constexpr int kRows = 16;

  BlockBorder(int radius, MaskMap& masked, DecodedView& view)
      : radius_(radius),
        masked_(masked),
        view_(view),
        joined_(static_cast<std::size_t>(masked.words() + 2)) {}

  void Run(int begin, int end) {
    found_.clear();
    for (int row = begin; row < end; ++row) {
      FindRow(row);
    }
    for (const BorderWord& word : found_) {
      Mark(word);
    }
  }

 private:
  void FindRow(int row) {
    JoinRows(masked_, row, radius_, joined_);
    const std::uint64_t* const own = masked_.Row(row);
    int count = 0;
    for (int i = 0; i < masked_.words(); ++i) {
      const std::uint64_t* const near = &joined_[static_cast<std::size_t>(i) + 1];
      const std::uint64_t valid = masked_.Inside(i) & ~own[i];
      if (valid == 0 || (near[-1] | near[0] | near[1]) == 0) {
        continue;
      }
      if (const std::uint64_t pixels = Widened(near, radius_) & valid; pixels != 0) {
        found_.push_back({row, i * MaskMap::kWordPx, pixels});
        count += std::popcount(pixels);
        const int first = i * MaskMap::kWordPx + std::countr_zero(pixels);
        __builtin_prefetch(view_.cause[row] + first, 1);
        __builtin_prefetch(view_.coordinate_px[row] + first, 1);
      }
    }
    masked_.CountBorder(row, count);
  }

  void Mark(BorderWord word) {
    std::uint8_t* const cause = view_.cause[word.row] + word.column;
    float* const coordinate_px = view_.coordinate_px[word.row] + word.column;
    for (; word.pixels != 0; word.pixels &= word.pixels - 1) {
      const int x = std::countr_zero(word.pixels);
      cause[x] = static_cast<std::uint8_t>(MaskCause::kBorder);
      coordinate_px[x] = std::numeric_limits<float>::quiet_NaN();
    }
  }

  int radius_;
  MaskMap& masked_;
  DecodedView& view_;
  Words joined_;
  std::vector<BorderWord> found_;
};

}  // namespace

void DropMaskBorder(const ReconstructionConfig& config, MaskMap& masked, DecodedView& view) {
  ParallelRows(config.threads, view.cause.rows, [&](int begin, int end) {
    BlockBorder border(config.mask_border_px, masked, view);
    for (int row = begin; row < end; row += BlockBorder::kRows) {
      border.Run(row, std::min(row + BlockBorder::kRows, end));
    }
  });
  view.count = masked.CountByCause();
}

}  // namespace forgescan
