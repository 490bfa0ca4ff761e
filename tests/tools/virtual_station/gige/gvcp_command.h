// A GVCP command as a client writes it.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/gvcp.h"

namespace forgescan::gige {

using Bytes = std::vector<std::uint8_t>;

inline Bytes Command(GvcpOperation operation, const std::vector<std::uint32_t>& words, std::uint16_t id = 7) {
  Bytes bytes{0x42, 0x01, 0, 0, 0, 0, 0, 0};
  Put16(bytes, 2, static_cast<std::uint32_t>(operation));
  Put16(bytes, 4, static_cast<std::uint32_t>(words.size() * 4));
  Put16(bytes, 6, id);
  for (const std::uint32_t word : words) {
    Append32(bytes, word);
  }
  return bytes;
}

}  // namespace forgescan::gige
