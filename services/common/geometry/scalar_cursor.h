// Reads one scalar after the other from the body of a PLY or PCD file, whatever its encoding, never past its
// end.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>

namespace forgescan {

enum class ScalarType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
enum class Encoding { kAscii, kLittleEndian, kBigEndian };

constexpr std::size_t SizeOf(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
    case ScalarType::kUint8:
      return 1;
    case ScalarType::kInt16:
    case ScalarType::kUint16:
      return 2;
    case ScalarType::kInt32:
    case ScalarType::kUint32:
    case ScalarType::kFloat32:
      return 4;
    case ScalarType::kFloat64:
      break;
  }
  return 8;
}

class ScalarCursor {
 public:
  ScalarCursor(std::string_view body, Encoding encoding) : body_(body), encoding_(encoding) {}

  // Before and after the scalars of a row. In ascii a row is one line; binary rows have no border. EndRow:
  // false if the line holds more words than were read.
  void BeginRow() {
    if (encoding_ == Encoding::kAscii) row_end_ = std::min(body_.find('\n', at_), body_.size());
  }
  bool EndRow() {
    if (encoding_ != Encoding::kAscii) return true;
    const bool complete =
        body_.substr(at_, row_end_ - at_).find_first_not_of(kSpace) == std::string_view::npos;
    at_ = std::min(row_end_ + 1, body_.size());
    return complete;
  }

  // nullopt: the body (in ascii the row) ended, or the next word of an ascii row is not a number.
  // Not-a-number and infinity are numbers here.
  std::optional<double> Next(ScalarType type) {
    return encoding_ == Encoding::kAscii ? NextWord() : NextBinary(type);
  }

  std::size_t remaining_bytes() const { return body_.size() - at_; }

  // After the last row: nothing but blanks in ascii, not a byte in binary.
  bool AtEnd() const {
    return encoding_ == Encoding::kAscii ? body_.find_first_not_of(kSpace, at_) == std::string_view::npos
                                         : remaining_bytes() == 0;
  }

 private:
  static constexpr std::string_view kSpace = " \t\r\n";

  std::optional<double> NextWord() {
    const std::string_view row = body_.substr(0, row_end_);
    const std::size_t begin = row.find_first_not_of(kSpace, at_);
    if (begin == std::string_view::npos) {
      return std::nullopt;
    }
    const std::size_t end = std::min(row.find_first_of(kSpace, begin), row.size());
    at_ = end;
    const char* first = body_.data() + begin + (body_[begin] == '+' ? 1 : 0);
    const char* last = body_.data() + end;
    double value = 0;
    const auto [stop, failure] = std::from_chars(first, last, value);
    return failure == std::errc() && stop == last ? std::optional(value) : std::nullopt;
  }

  template <typename T>
  double Decode() {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), body_.data() + at_, sizeof(T));
    constexpr bool kHostIsLittle = std::endian::native == std::endian::little;
    if ((encoding_ == Encoding::kLittleEndian) != kHostIsLittle) {
      std::reverse(bytes.begin(), bytes.end());
    }
    at_ += sizeof(T);
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  std::optional<double> NextBinary(ScalarType type) {
    if (remaining_bytes() < SizeOf(type)) {
      return std::nullopt;
    }
    switch (type) {
      case ScalarType::kInt8:
        return Decode<std::int8_t>();
      case ScalarType::kUint8:
        return Decode<std::uint8_t>();
      case ScalarType::kInt16:
        return Decode<std::int16_t>();
      case ScalarType::kUint16:
        return Decode<std::uint16_t>();
      case ScalarType::kInt32:
        return Decode<std::int32_t>();
      case ScalarType::kUint32:
        return Decode<std::uint32_t>();
      case ScalarType::kFloat32:
        return Decode<float>();
      case ScalarType::kFloat64:
        break;
    }
    return Decode<double>();
  }

  std::string_view body_;
  Encoding encoding_;
  std::size_t at_ = 0;
  std::size_t row_end_ = 0;  // ascii only: the byte after the row that BeginRow() opened
};

}  // namespace forgescan
