// Integers as LCM writes them.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>

#include "services/common/bus/bus.h"

namespace forgescan {

// The integer whose first byte is bytes[at]; the caller has made sure that all of it is there.
template <typename Integer>
Integer BigEndianAt(ByteView bytes, std::size_t at) {
  assert(at + sizeof(Integer) <= bytes.size());
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    value = value << 8 | bytes[at + i];
  }
  return static_cast<Integer>(value);
}

}  // namespace forgescan
