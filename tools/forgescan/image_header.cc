#include "tools/forgescan/image_header.h"

#include <algorithm>
#include <array>

namespace forgescan {
namespace {

constexpr std::string_view kPng = "\x89PNG\r\n\x1A\n";
constexpr std::string_view kLittleTiff("II*\0", 4), kBigTiff("MM\0*", 4);

enum class Order { kLittle, kBig };

// The unsigned number of `size` bytes at a place of the file; nothing beyond its end.
std::optional<std::uint64_t> NumberAt(std::string_view bytes, std::uint64_t at, std::size_t size,
                                      Order order) {
  if (bytes.size() < size || at > bytes.size() - size) return std::nullopt;
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t place = order == Order::kBig ? i : size - 1 - i;
    number = number << 8 | static_cast<std::uint8_t>(bytes[at + place]);
  }
  return number;
}

std::optional<std::uint64_t> Product(std::optional<std::uint64_t> width,
                                     std::optional<std::uint64_t> height) {
  if (!width || !height) return std::nullopt;
  return *width * *height;  // each has at most 32 bits
}

// The number behind white space and comments, which is taken off the text.
std::optional<std::uint64_t> TakeNumber(std::string_view& text) {
  constexpr std::string_view kSpace = " \t\r\n\f\v";
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  while (text.starts_with('#')) {
    text.remove_prefix(std::min(text.find('\n'), text.size()));
    text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  }
  std::uint64_t number = 0;
  std::size_t digits = 0;
  for (; digits < text.size() && text[digits] >= '0' && text[digits] <= '9'; ++digits) {
    number =
        std::min<std::uint64_t>(number * 10 + static_cast<std::uint64_t>(text[digits] - '0'), UINT32_MAX);
  }
  text.remove_prefix(digits);
  return digits > 0 ? std::optional(number) : std::nullopt;
}

std::optional<std::uint64_t> PnmPixels(std::string_view bytes) {
  bytes.remove_prefix(2);
  const auto width = TakeNumber(bytes);
  return Product(width, TakeNumber(bytes));
}

// Source: TIFF 6.0, section 2: the first directory, tags 256 and 257, of type SHORT or LONG.
std::optional<std::uint64_t> TiffPixels(std::string_view bytes, Order order) {
  constexpr std::uint64_t kWidthTag = 256, kHeightTag = 257, kShort = 3, kEntryBytes = 12;
  const auto directory = NumberAt(bytes, 4, 4, order);
  const auto entries = directory ? NumberAt(bytes, *directory, 2, order) : std::nullopt;
  std::array<std::optional<std::uint64_t>, 2> sides;
  for (std::uint64_t i = 0; entries && i < *entries; ++i) {
    const std::uint64_t at = *directory + 2 + i * kEntryBytes;
    const auto tag = NumberAt(bytes, at, 2, order), type = NumberAt(bytes, at + 2, 2, order);
    if (tag == kWidthTag || tag == kHeightTag) {
      sides[*tag - kWidthTag] = NumberAt(bytes, at + 8, type == kShort ? 2 : 4, order);
    }
  }
  return Product(sides[0], sides[1]);
}

}  // namespace

std::optional<std::uint64_t> ClaimedPixels(std::string_view bytes) {
  if (bytes.starts_with(kPng)) {
    return Product(NumberAt(bytes, 16, 4, Order::kBig), NumberAt(bytes, 20, 4, Order::kBig));
  }
  if (bytes.starts_with("BM")) {
    const auto height = NumberAt(bytes, 22, 4, Order::kLittle);  // negative: the first row is the upper one
    const bool from_above = height && *height > INT32_MAX;
    return Product(NumberAt(bytes, 18, 4, Order::kLittle),
                   from_above ? std::optional((std::uint64_t{1} << 32) - *height) : height);
  }
  if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '7') return PnmPixels(bytes);
  if (bytes.starts_with(kLittleTiff)) return TiffPixels(bytes, Order::kLittle);
  if (bytes.starts_with(kBigTiff)) return TiffPixels(bytes, Order::kBig);
  return std::nullopt;
}

}  // namespace forgescan
