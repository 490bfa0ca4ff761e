// Recorded messages in words, by the type definitions that the recording brings along.
#pragma once

#include <string>
#include <vector>

#include "services/common/log/lcm_type.h"

namespace forgescan {

// "FRAME_LEFT part 1 view 3 attempt 0 camera 1 pattern 2": the channel and what tells the message from
// others. Only the channel if the message does not decode.
std::string MessageTitle(const LcmTypes& types, const std::string& channel, ByteView message);

// The fields in which two messages of one type differ, one line each, e.g. "dimensions[2].measured_mm:
// recorded 88.512, now 88.498"; for bytes how many and the first. At most `limit` lines, then one that counts
// the rest. Without the fields the stream's checksum is made of: it differs whenever another does.
std::vector<std::string> FieldDifferences(const LcmTypes& types, ByteView recorded, ByteView now,
                                          std::size_t limit);

}  // namespace forgescan
