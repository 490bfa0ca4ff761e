// A recorded message in words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "services/common/bus/bus.h"

namespace forgescan {

// "FRAME_LEFT part 1 view 3 attempt 0 camera 1 pattern 2": the channel and what tells the message from others,
// also of a message that was changed. Only the channel if its fields cannot be read.
std::string MessageTitle(const std::string& channel, ByteView message);

// The fields in which two messages of one channel differ, one line each: "dimensions[2].measured_mm: recorded
// 88.512, now 88.498". At most `limit` lines; then one that says how many more.
std::vector<std::string> FieldDifferences(const std::string& channel, ByteView recorded, ByteView now,
                                          std::size_t limit);

}  // namespace forgescan
