#include "services/recorder/recorded_message.h"

#include <cstring>
#include <string_view>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/recorder/gaps.h"

namespace forgescan {
namespace {

// Every type of a stream begins with utime, session, sequence, crc32 and then its part, but for one.
constexpr std::size_t kUtimeAt = 8, kSessionAt = 16, kSequenceAt = 24, kPartAt = kStreamHeaderBytes;

template <typename Integer>
Integer BigEndian(ByteView bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) {
    value = value << 8 | bytes[at + i];
  }
  return static_cast<Integer>(value);
}

std::optional<std::int32_t> PartIn(const ChannelInfo& channel, ByteView bytes) {
  if (std::string_view(channel.type) == fsmsg::processing_time_t::getTypeName()) {
    const auto time = Decode<fsmsg::processing_time_t>(bytes);
    return time.ok() ? std::optional(time->part) : std::nullopt;
  }
  const bool ours = bytes.size() >= kPartAt + sizeof(std::int32_t) &&
                    BigEndian<std::int64_t>(bytes, 0) == channel.fingerprint;
  return ours ? std::optional(BigEndian<std::int32_t>(bytes, kPartAt)) : std::nullopt;
}

}  // namespace

StreamMessage ReadStreamMessage(const ChannelInfo& channel, ByteView bytes, std::int64_t now_us) {
  StreamMessage read;
  read.message.now_us = now_us;
  read.message.bytes = static_cast<std::int64_t>(bytes.size());
  if (bytes.size() < kStreamHeaderBytes) {
    return read;
  }
  read.message.utime = BigEndian<std::int64_t>(bytes, kUtimeAt);
  read.header = {BigEndian<std::int64_t>(bytes, kSessionAt), BigEndian<std::int64_t>(bytes, kSequenceAt)};
  read.message.part = PartIn(channel, bytes);
  const std::string_view name = channel.name;
  if (name == kPartArrived.name) {
    read.message.kind = RecordedMessage::Kind::kArrived;
  } else if (name == kPartSorted.name) {
    read.message.kind = RecordedMessage::Kind::kSorted;
  } else if (name == kVerdict.name) {
    const auto verdict = Decode<fsmsg::verdict_t>(bytes);
    read.message.kind = verdict.ok() ? RecordedMessage::Kind::kJudged : RecordedMessage::Kind::kStream;
    read.message.verdict = verdict.ok() ? verdict->verdict : std::int8_t{0};
  }
  return read;
}

fsmsg::recording_gap_t DroppedGap(const ChannelInfo& channel, ByteView bytes) {
  fsmsg::recording_gap_t gap = GapOf(channel.name, "left out: the disk was too slow");
  if (channel.kind == ChannelKind::kStream && bytes.size() >= kStreamHeaderBytes) {
    gap.session = BigEndian<std::int64_t>(bytes, kSessionAt);
    gap.first_sequence = gap.last_sequence = BigEndian<std::int64_t>(bytes, kSequenceAt);
  }
  return gap;
}

}  // namespace forgescan
