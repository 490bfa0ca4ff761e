#include "drivers/can/can_msgpack.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string_view>

namespace forgescan {
namespace {

constexpr int kMaxDepth = 4;

// ---- writing ----
using Bytes = std::vector<std::uint8_t>;

void PutBigEndian(Bytes& out, std::uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    out.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

void PutText(Bytes& out, std::string_view text) {  // fixstr: every key here is shorter than 32
  out.push_back(static_cast<std::uint8_t>(0xA0 | text.size()));
  out.insert(out.end(), text.begin(), text.end());
}

void PutBool(Bytes& out, std::string_view key, bool value) {
  PutText(out, key);
  out.push_back(value ? 0xC3 : 0xC2);
}

void PutUnsigned(Bytes& out, std::string_view key, std::uint32_t value) {
  PutText(out, key);
  if (value < 0x80) {
    out.push_back(static_cast<std::uint8_t>(value));
  } else {
    out.push_back(0xCE);
    PutBigEndian(out, value, 4);
  }
}

// ---- reading ----
// One MessagePack value: what this format can hold, the rest is skipped.
struct Value {
  enum class Kind { kOther, kBool, kInteger, kBytes, kMap } kind = Kind::kOther;
  bool flag = false;
  std::int64_t integer = 0;  // also the number of pairs of a map
  std::span<const std::uint8_t> bytes = {};
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  // Maps are returned opened: the caller reads the pairs. Arrays are skipped whole. Nothing when cut short.
  std::optional<Value> Next(int depth = 0);
  bool SkipValue(int depth);
  bool empty() const { return rest_.empty(); }

 private:
  std::optional<std::uint64_t> TakeBigEndian(std::size_t count);
  std::optional<std::span<const std::uint8_t>> Take(std::size_t count);
  std::optional<Value> TakeBytes(std::optional<std::uint64_t> count);
  std::optional<Value> TakeArray(std::optional<std::uint64_t> count, int depth);
  std::optional<Value> TakeOther(std::size_t count);
  std::optional<Value> TakeInteger(std::uint8_t tag);
  std::optional<Value> TakeSized(std::uint8_t tag, int depth);

  std::span<const std::uint8_t> rest_;
};

std::optional<std::span<const std::uint8_t>> Reader::Take(std::size_t count) {
  if (count > rest_.size()) {
    return std::nullopt;
  }
  const auto head = rest_.first(count);
  rest_ = rest_.subspan(count);
  return head;
}

std::optional<std::uint64_t> Reader::TakeBigEndian(std::size_t count) {
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

std::optional<Value> Reader::TakeBytes(std::optional<std::uint64_t> count) {
  const auto bytes = count ? Take(static_cast<std::size_t>(*count)) : std::nullopt;
  return bytes ? std::optional(Value{.kind = Value::Kind::kBytes, .bytes = *bytes}) : std::nullopt;
}

std::optional<Value> Reader::TakeOther(std::size_t count) {
  return Take(count) ? std::optional(Value{}) : std::nullopt;
}

std::optional<Value> Reader::TakeArray(std::optional<std::uint64_t> count, int depth) {
  if (!count || *count > rest_.size()) {  // an element takes at least one byte
    return std::nullopt;
  }
  for (std::uint64_t i = 0; i < *count; ++i) {
    if (!SkipValue(depth + 1)) {
      return std::nullopt;
    }
  }
  return Value{};
}

std::optional<Value> MapOf(std::optional<std::uint64_t> pairs) {
  if (!pairs) {
    return std::nullopt;
  }
  return Value{.kind = Value::Kind::kMap, .integer = static_cast<std::int64_t>(*pairs)};
}

// 0xCC..0xCF unsigned, 0xD0..0xD3 signed, of 1, 2, 4, 8 bytes.
std::optional<Value> Reader::TakeInteger(std::uint8_t tag) {
  const std::size_t count = std::size_t{1} << (tag & 3);
  const auto raw = TakeBigEndian(count);
  if (!raw) {
    return std::nullopt;
  }
  const bool is_signed = tag >= 0xD0;
  const int shift = static_cast<int>(64 - 8 * count);
  const auto extended = static_cast<std::int64_t>(*raw << shift) >> shift;
  if (!is_signed && *raw > static_cast<std::uint64_t>(INT64_MAX)) {
    return Value{};
  }
  return Value{.kind = Value::Kind::kInteger,
               .integer = is_signed ? extended : static_cast<std::int64_t>(*raw)};
}

std::optional<Value> Reader::TakeSized(std::uint8_t tag, int depth) {
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
      return Value{};
    case 0xC2:
    case 0xC3:
      return Value{.kind = Value::Kind::kBool, .flag = tag == 0xC3};
    default:
      return std::nullopt;  // clang-format on
  }
}

std::optional<Value> Reader::Next(int depth) {
  const auto head = Take(1);
  if (!head || depth > kMaxDepth) {
    return std::nullopt;
  }
  const std::uint8_t tag = head->front();
  if (tag < 0x80 || tag >= 0xE0) {
    return Value{.kind = Value::Kind::kInteger, .integer = static_cast<std::int8_t>(tag)};
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

bool Reader::SkipValue(int depth) {
  const auto value = Next(depth);
  if (!value || value->kind != Value::Kind::kMap) {
    return value.has_value();
  }
  for (std::int64_t i = 0; i < 2 * value->integer; ++i) {
    if (!SkipValue(depth + 1)) {
      return false;
    }
  }
  return true;
}

// What a datagram said, before its ranges are checked.
struct Fields {
  std::optional<std::int64_t> id, dlc;
  std::optional<bool> extended, rtr, error;
  std::optional<std::span<const std::uint8_t>> data;
  bool is_fd = false;
};

bool Store(std::string_view key, const Value& value, Fields& fields) {
  const bool is_flag = value.kind == Value::Kind::kBool;
  if (key == "arbitration_id" || key == "dlc") {
    (key == "dlc" ? fields.dlc : fields.id) = value.integer;
    return value.kind == Value::Kind::kInteger;
  }
  if (key == "data") {
    fields.data = value.bytes;
    return value.kind == Value::Kind::kBytes;
  }
  if (key == "is_extended_id") {
    fields.extended = value.flag;
  } else if (key == "is_remote_frame") {
    fields.rtr = value.flag;
  } else if (key == "is_error_frame") {
    fields.error = value.flag;
  } else if (key == "is_fd") {
    fields.is_fd = value.flag;
  } else {
    return true;
  }
  return is_flag;
}

Result<Fields> ReadFields(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  const auto map = reader.Next();
  if (!map || map->kind != Value::Kind::kMap) {
    return Fail(ErrorCode::kFormat, "CAN datagram of {} bytes does not start with a MessagePack map",
                bytes.size());
  }
  Fields fields;
  for (std::int64_t i = 0; i < map->integer; ++i) {
    const auto key = reader.Next(1);
    const auto value = key ? reader.Next(1) : std::nullopt;
    if (!key || key->kind != Value::Kind::kBytes || !value || value->kind == Value::Kind::kMap) {
      return Fail(ErrorCode::kFormat,
                  "CAN datagram of {} bytes: pair {} of {} is cut short or of a wrong type", bytes.size(), i,
                  map->integer);
    }
    const std::string_view name(reinterpret_cast<const char*>(key->bytes.data()), key->bytes.size());
    if (!Store(name, *value, fields)) {
      return Fail(ErrorCode::kFormat, "CAN datagram: the value of '{}' has a wrong type", name);
    }
  }
  return fields;
}

}  // namespace

std::vector<std::uint8_t> EncodeCanDatagram(const CanFrame& frame, std::int64_t timestamp_us) {
  Bytes out;
  out.reserve(192);
  out.push_back(0x80 | 11);
  PutText(out, "timestamp");
  out.push_back(0xCB);
  PutBigEndian(out, std::bit_cast<std::uint64_t>(static_cast<double>(timestamp_us) * 1e-6), 8);
  PutUnsigned(out, "arbitration_id", frame.id);
  PutBool(out, "is_extended_id", frame.extended);
  PutBool(out, "is_remote_frame", frame.rtr);
  PutBool(out, "is_error_frame", frame.error);
  PutText(out, "channel");
  out.push_back(0xC0);
  PutUnsigned(out, "dlc", frame.length);
  PutText(out, "data");
  const std::uint8_t stored = frame.rtr ? 0 : frame.length;
  out.push_back(0xC4);
  out.push_back(stored);
  out.insert(out.end(), frame.data.begin(), frame.data.begin() + stored);
  PutBool(out, "is_fd", false);
  PutBool(out, "bitrate_switch", false);
  PutBool(out, "error_state_indicator", false);
  return out;
}

Result<CanFrame> DecodeCanDatagram(std::span<const std::uint8_t> bytes) {
  ASSIGN_OR_RETURN(const Fields fields, ReadFields(bytes));
  if (!fields.id || !fields.dlc || !fields.extended || !fields.rtr || !fields.error || !fields.data) {
    return Fail(ErrorCode::kFormat,
                "CAN datagram lacks one of arbitration_id, dlc, data or the three is_ flags");
  }
  const std::int64_t limit = *fields.extended ? kMaxExtendedCanId : kMaxStandardCanId;
  if (fields.is_fd || *fields.dlc < 0 || *fields.dlc > 8 || *fields.id < 0 || *fields.id > limit) {
    return Fail(ErrorCode::kFormat, "CAN datagram: id {} dlc {} fd {} is outside 0..{}, 0..8, false",
                *fields.id, *fields.dlc, fields.is_fd, limit);
  }
  const std::size_t expected = *fields.rtr ? 0 : static_cast<std::size_t>(*fields.dlc);
  if (fields.data->size() != expected) {
    return Fail(ErrorCode::kFormat, "CAN datagram: {} data bytes with dlc {}", fields.data->size(),
                *fields.dlc);
  }
  CanFrame frame;
  frame.id = static_cast<std::uint32_t>(*fields.id);
  frame.extended = *fields.extended;
  frame.rtr = *fields.rtr;
  frame.error = *fields.error;
  frame.length = static_cast<std::uint8_t>(*fields.dlc);
  std::copy(fields.data->begin(), fields.data->end(), frame.data.begin());
  return frame;
}

}  // namespace forgescan
