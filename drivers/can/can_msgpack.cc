#include "drivers/can/can_msgpack.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string_view>

#include "drivers/can/msgpack_reader.h"

namespace forgescan {
namespace {

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

// What a datagram said, before its ranges are checked.
struct Fields {
  std::optional<std::int64_t> id, dlc;
  std::optional<bool> extended, rtr, error;
  std::optional<std::span<const std::uint8_t>> data;
  bool is_fd = false;
};

bool Store(std::string_view key, const MsgpackValue& value, Fields& fields) {
  const bool is_flag = value.kind == MsgpackValue::Kind::kBool;
  if (key == "arbitration_id" || key == "dlc") {
    (key == "dlc" ? fields.dlc : fields.id) = value.integer;
    return value.kind == MsgpackValue::Kind::kInteger;
  }
  if (key == "data") {
    fields.data = value.bytes;
    return value.kind == MsgpackValue::Kind::kBytes;
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
  MsgpackReader reader(bytes);
  const auto map = reader.Next();
  if (!map || map->kind != MsgpackValue::Kind::kMap) {
    return Fail(ErrorCode::kFormat, "CAN datagram of {} bytes does not start with a MessagePack map",
                bytes.size());
  }
  Fields fields;
  for (std::int64_t i = 0; i < map->integer; ++i) {
    const auto key = reader.Next(1);
    const auto value = key ? reader.Next(1) : std::nullopt;
    if (!key || key->kind != MsgpackValue::Kind::kBytes || !value ||
        value->kind == MsgpackValue::Kind::kMap) {
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
