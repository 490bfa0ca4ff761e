// What the recorder has to know of a message, taken from its bytes.
#pragma once

#include "services/common/bus/bus.h"
#include "services/common/bus/channel_list.h"
#include "services/recorder/recording_machine.h"

namespace forgescan {

// Of a message on a stream, delivered at `now_us`. It was checked by the stream's receiver. What does not
// decode has no part.
RecordedMessage ReadStreamMessage(const ChannelInfo& channel, ByteView bytes, std::int64_t now_us);

// For a message that is left out for want of room; a state has no number.
fsmsg::recording_gap_t DroppedGap(const ChannelInfo& channel, ByteView bytes);

}  // namespace forgescan
