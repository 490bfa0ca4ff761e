#include "services/recorder/recorded_message.h"

#include <cstring>
#include <string_view>

#include "services/common/bus/big_endian.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_header.h"
#include "services/recorder/gaps.h"

namespace forgescan {
namespace {

// Every type of a stream begins with utime, session, sequence, crc32 and then its part, but for one.
constexpr std::size_t kPartAt = kStreamHeaderBytes;

std::optional<std::int32_t> PartIn(const ChannelInfo& channel, ByteView bytes) {
  if (std::string_view(channel.type) == fsmsg::processing_time_t::getTypeName()) {
    const auto time = Decode<fsmsg::processing_time_t>(bytes);
    return time.ok() ? std::optional(time->part) : std::nullopt;
  }
  const bool ours = bytes.size() >= kPartAt + sizeof(std::int32_t) &&
                    BigEndianAt<std::int64_t>(bytes, 0) == channel.fingerprint;
  return ours ? std::optional(BigEndianAt<std::int32_t>(bytes, kPartAt)) : std::nullopt;
}

}  // namespace

RecordedMessage ReadStreamMessage(const ChannelInfo& channel, ByteView bytes, std::int64_t now_us) {
  RecordedMessage read;
  read.now_us = now_us;
  read.bytes = static_cast<std::int64_t>(bytes.size());
  const auto header = ReadStreamHeader(bytes);
  const auto utime = StreamUtime(bytes);
  if (!header.ok() || !utime.ok()) {
    return read;
  }
  read.utime = *utime;
  read.part = PartIn(channel, bytes);
  const std::string_view name = channel.name;
  if (name == kPartArrived.name) {
    read.kind = RecordedMessage::Kind::kArrived;
  } else if (name == kPartSorted.name) {
    read.kind = RecordedMessage::Kind::kSorted;
  } else if (name == kVerdict.name) {
    const auto verdict = Decode<fsmsg::verdict_t>(bytes);
    read.kind = verdict.ok() ? RecordedMessage::Kind::kJudged : RecordedMessage::Kind::kStream;
    read.verdict = verdict.ok() ? verdict->verdict : std::int8_t{0};
  }
  return read;
}

fsmsg::recording_gap_t DroppedGap(const ChannelInfo& channel, ByteView bytes) {
  fsmsg::recording_gap_t gap = GapOf(channel.name, "left out: the disk was too slow");
  if (const auto header = ReadStreamHeader(bytes); channel.kind == ChannelKind::kStream && header.ok()) {
    gap.session = header->session;
    gap.first_sequence = gap.last_sequence = header->sequence;
  }
  return gap;
}

}  // namespace forgescan
