// Encoding and decoding of LCM types without exceptions and without half-decoded objects.
#pragma once

#include <exception>

#include "services/common/bus/bus.h"

namespace forgescan {

template <typename Message>
Bytes Encode(const Message& message) {
  Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// Errors: kFormat (another type, truncated, trailing bytes, impossible sizes).
template <typename Message>
Result<Message> Decode(ByteView bytes) {
  try {
    Message message{};
    const int used = message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
    if (used == static_cast<int>(bytes.size())) {
      return message;
    }
    return Fail(ErrorCode::kFormat, "{} bytes do not decode as {}", bytes.size(), Message::getTypeName());
  } catch (const std::exception& error) {  // LCM's generated code trusts array sizes from the wire
    return Fail(ErrorCode::kFormat, "{} bytes do not decode as {}: {}", bytes.size(), Message::getTypeName(),
                error.what());
  }
}

}  // namespace forgescan
