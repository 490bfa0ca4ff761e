#include "services/reconstruction/mask_map.h"

#include <emmintrin.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>

namespace forgescan {
namespace {

using RowCounts = std::array<int, kMaskCauses>;
constexpr int kWordPx = MaskMap::kWordPx;

std::uint64_t MaskedBits(const std::uint8_t* cause) {
  std::uint64_t valid = 0;
  for (int x = 0; x < kWordPx; x += 16) {
    const __m128i causes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(cause + x));
    const int bits = _mm_movemask_epi8(_mm_cmpeq_epi8(causes, _mm_setzero_si128()));
    valid |= static_cast<std::uint64_t>(bits) << x;
  }
  return ~valid;
}

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

// Causes come in long runs.
template <int length>
void Count(const std::uint8_t* cause, RowCounts& counts) {
  if (IsUniform<length>(cause)) {
    counts[cause[0]] += length;
  } else if constexpr (length == 8) {
    std::for_each_n(cause, length, [&](std::uint8_t one) { ++counts[one]; });
  } else {
    for (int x = 0; x < length; x += 8) {
      Count<8>(cause + x, counts);
    }
  }
}

}  // namespace

MaskMap::MaskMap(cv::Size size)
    : width_(size.width),
      words_((size.width + kWordPx - 1) / kWordPx),
      bits_(Begin(size.height)),
      counts_(static_cast<std::size_t>(size.height)) {}

void MaskMap::SetRow(int row, const std::uint8_t* cause) {
  std::uint64_t* const bits = &bits_[Begin(row)];
  RowCounts& counts = counts_[static_cast<std::size_t>(row)];
  counts = {};
  const int whole = width_ / kWordPx;
  for (int i = 0; i < whole; ++i) {
    bits[i] = MaskedBits(cause + i * kWordPx);
    bits[i] == 0 ? void(counts[0] += kWordPx) : Count<kWordPx>(cause + i * kWordPx, counts);
  }
  if (whole < words_) {
    std::array<std::uint8_t, kWordPx> rest{};
    const int left = width_ - whole * kWordPx;
    std::copy_n(cause + whole * kWordPx, left, rest.begin());
    bits[whole] = MaskedBits(rest.data());
    Count<kWordPx>(rest.data(), counts);
    counts[0] -= kWordPx - left;
  }
}

void MaskMap::Unmask(int row, int column, MaskCause before) {
  bits_[Begin(row) + static_cast<std::size_t>(column / kWordPx)] &= ~(std::uint64_t{1} << (column % kWordPx));
  RowCounts& counts = counts_[static_cast<std::size_t>(row)];
  --counts[static_cast<std::size_t>(before)];
  ++counts[0];
}

void MaskMap::CountBorder(int row, int pixels) {
  RowCounts& counts = counts_[static_cast<std::size_t>(row)];
  counts[0] -= pixels;
  counts[static_cast<std::size_t>(MaskCause::kBorder)] += pixels;
}

std::array<long, kMaskCauses> MaskMap::CountByCause() const {
  std::array<long, kMaskCauses> sum{};
  for (const RowCounts& counts : counts_) {
    std::transform(counts.begin(), counts.end(), sum.begin(), sum.begin(), std::plus<long>());
  }
  return sum;
}

}  // namespace forgescan
