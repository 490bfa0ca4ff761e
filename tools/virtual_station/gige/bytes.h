// Big-endian fields in byte buffers, as every part of GigE Vision uses them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace forgescan::gige {

inline std::uint16_t Get16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8) | bytes[at + 1]);
}
inline std::uint32_t Get32(std::span<const std::uint8_t> bytes, std::size_t at) {
  return (static_cast<std::uint32_t>(Get16(bytes, at)) << 16) | Get16(bytes, at + 2);
}

inline void Put16(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t value) {
  bytes[at] = static_cast<std::uint8_t>(value >> 8);
  bytes[at + 1] = static_cast<std::uint8_t>(value);
}
inline void Put32(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t value) {
  Put16(bytes, at, value >> 16);
  Put16(bytes, at + 2, value & 0xffff);
}
inline void Put64(std::span<std::uint8_t> bytes, std::size_t at, std::uint64_t value) {
  Put32(bytes, at, static_cast<std::uint32_t>(value >> 32));
  Put32(bytes, at + 4, static_cast<std::uint32_t>(value));
}

inline void Append32(std::vector<std::uint8_t>& bytes, std::uint32_t value) {
  bytes.resize(bytes.size() + 4);
  Put32(bytes, bytes.size() - 4, value);
}
inline void Append64(std::vector<std::uint8_t>& bytes, std::uint64_t value) {
  bytes.resize(bytes.size() + 8);
  Put64(bytes, bytes.size() - 8, value);
}

}  // namespace forgescan::gige
