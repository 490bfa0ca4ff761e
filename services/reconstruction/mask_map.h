// Which pixels of a view are masked, a bit each, and how many there are of each cause.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "services/reconstruction/decoded_view.h"

namespace forgescan {

// Rows may be written from several threads, each row from one.
class MaskMap {
 public:
  static constexpr int kWordPx = 64;

  explicit MaskMap(cv::Size size);

  // The causes of a whole row.
  void SetRow(int row, const std::uint8_t* cause);
  // One pixel is masked no longer.
  void Unmask(int row, int column, MaskCause before);
  // One valid pixel is to be masked; the bits stay as they are.
  void CountBorder(int row, int pixels);

  // Word i has pixels 64 i and up, from bit 0. Words -1 and words() may be read. No bit beyond the image is
  // set.
  const std::uint64_t* Row(int row) const { return &bits_[Begin(row)]; }
  int words() const { return words_; }
  int rows() const { return static_cast<int>(counts_.size()); }
  // The pixels of word i that are in the image.
  std::uint64_t Inside(int i) const {
    const int left = width_ - i * kWordPx;
    return left >= kWordPx ? ~std::uint64_t{0} : (std::uint64_t{1} << left) - 1;
  }
  std::array<long, kMaskCauses> CountByCause() const;

 private:
  std::size_t Begin(int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(words_ + 2) + 1;
  }

  int width_;
  int words_;
  std::vector<std::uint64_t> bits_;
  std::vector<std::array<int, kMaskCauses>> counts_;  // of each row
};

}  // namespace forgescan
