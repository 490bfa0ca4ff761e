#include "drivers/can/msgpack_reader.h"

namespace forgescan {
namespace {

constexpr int kMaxDepth = 4;

std::optional<MsgpackValue> MapOf(std::optional<std::uint64_t> pairs) {
  if (!pairs) {
    return std::nullopt;
  }
  return MsgpackValue{.kind = MsgpackValue::Kind::kMap, .integer = static_cast<std::int64_t>(*pairs)};
}

}  // namespace

std::optional<std::span<const std::uint8_t>> MsgpackReader::Take(std::size_t count) {
  if (count > rest_.size()) {
    return std::nullopt;
  }
  const auto head = rest_.first(count);
  rest_ = rest_.subspan(count);
  return head;
}

std::optional<std::uint64_t> MsgpackReader::TakeBigEndian(std::size_t count) {
  const auto bytes = Take(count);
  if (!bytes) {
    return std::nullopt;
  }
  std::uint64_t value = 0;
  for (const std::uint8_t byte : *bytes) {
    value = value << 8 | byte;
  }
  return value;
}

std::optional<MsgpackValue> MsgpackReader::TakeBytes(std::optional<std::uint64_t> count) {
  const auto bytes = count ? Take(static_cast<std::size_t>(*count)) : std::nullopt;
  return bytes ? std::optional(MsgpackValue{.kind = MsgpackValue::Kind::kBytes, .bytes = *bytes})
               : std::nullopt;
}

std::optional<MsgpackValue> MsgpackReader::TakeOther(std::size_t count) {
  return Take(count) ? std::optional(MsgpackValue{}) : std::nullopt;
}

std::optional<MsgpackValue> MsgpackReader::TakeArray(std::optional<std::uint64_t> count, int depth) {
  if (!count || *count > rest_.size()) {  // an element takes at least one byte
    return std::nullopt;
  }
  for (std::uint64_t i = 0; i < *count; ++i) {
    if (!SkipValue(depth + 1)) {
      return std::nullopt;
    }
  }
  return MsgpackValue{};
}

// 0xCC..0xCF unsigned, 0xD0..0xD3 signed, of 1, 2, 4, 8 bytes.
std::optional<MsgpackValue> MsgpackReader::TakeInteger(std::uint8_t tag) {
  const std::size_t count = std::size_t{1} << (tag & 3);
  const auto raw = TakeBigEndian(count);
  if (!raw) {
    return std::nullopt;
  }
  const bool is_signed = tag >= 0xD0;
  const int shift = static_cast<int>(64 - 8 * count);
  const auto extended = static_cast<std::int64_t>(*raw << shift) >> shift;
  if (!is_signed && *raw > static_cast<std::uint64_t>(INT64_MAX)) {
    return MsgpackValue{};
  }
  return MsgpackValue{.kind = MsgpackValue::Kind::kInteger,
                      .integer = is_signed ? extended : static_cast<std::int64_t>(*raw)};
}

std::optional<MsgpackValue> MsgpackReader::TakeSized(std::uint8_t tag, int depth) {
  switch (tag) {
    case 0xC4:
    case 0xD9:
      return TakeBytes(TakeBigEndian(1));  // clang-format off: a table reads best as one
    case 0xC5:
    case 0xDA:
      return TakeBytes(TakeBigEndian(2));
    case 0xC6:
    case 0xDB:
      return TakeBytes(TakeBigEndian(4));
    case 0xCA:
      return TakeOther(4);
    case 0xCB:
      return TakeOther(8);
    case 0xD4:
    case 0xD5:
    case 0xD6:
    case 0xD7:
    case 0xD8:
      return TakeOther(1 + (std::size_t{1} << (tag - 0xD4)));
    case 0xDC:
      return TakeArray(TakeBigEndian(2), depth);
    case 0xDD:
      return TakeArray(TakeBigEndian(4), depth);
    case 0xDE:
      return MapOf(TakeBigEndian(2));
    case 0xDF:
      return MapOf(TakeBigEndian(4));
    case 0xC0:
      return MsgpackValue{};
    case 0xC2:
    case 0xC3:
      return MsgpackValue{.kind = MsgpackValue::Kind::kBool, .flag = tag == 0xC3};
    default:
      return std::nullopt;  // clang-format on
  }
}

std::optional<MsgpackValue> MsgpackReader::Next(int depth) {
  const auto head = Take(1);
  if (!head || depth > kMaxDepth) {
    return std::nullopt;
  }
  const std::uint8_t tag = head->front();
  if (tag < 0x80 || tag >= 0xE0) {
    return MsgpackValue{.kind = MsgpackValue::Kind::kInteger, .integer = static_cast<std::int8_t>(tag)};
  }
  if (tag < 0x90) {
    return MapOf(tag & 0x0F);
  }
  if (tag < 0xA0) {
    return TakeArray(tag & 0x0F, depth);
  }
  if (tag < 0xC0) {
    return TakeBytes(tag & 0x1F);
  }
  return tag >= 0xCC && tag <= 0xD3 ? TakeInteger(tag) : TakeSized(tag, depth);
}

bool MsgpackReader::SkipValue(int depth) {
  const auto value = Next(depth);
  if (!value || value->kind != MsgpackValue::Kind::kMap) {
    return value.has_value();
  }
  for (std::int64_t i = 0; i < 2 * value->integer; ++i) {
    if (!SkipValue(depth + 1)) {
      return false;
    }
  }
  return true;
}

}  // namespace forgescan
