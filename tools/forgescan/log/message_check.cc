#include "tools/forgescan/log/message_check.h"

#include "services/common/bus/big_endian.h"
#include "services/common/log/lcm_decode.h"

namespace forgescan {

MessageCheck::MessageCheck(const Recording& recording) : recording_(recording) {
  if (recording.opened) {
    for (const fsmsg::recorded_channel_t& channel : recording.opened->channels) {
      announced_[channel.channel] = channel.fingerprint;
    }
  }
}

void MessageCheck::Add(const LogEntry& entry, ByteView message, std::vector<LogFinding>& findings) {
  const std::string& channel = recording_.log.ChannelOf(entry);
  if (message.size() < sizeof(std::int64_t)) {
    findings.push_back({entry.offset, channel, fmt::format("{} bytes are no LCM message", message.size())});
    return;
  }
  const auto fingerprint = BigEndianAt<std::int64_t>(message, 0);
  const LcmStruct* type = recording_.types.FindByFingerprint(fingerprint);
  if (type == nullptr) {
    Unknown& unknown = unknown_[{channel, static_cast<std::uint64_t>(fingerprint)}];
    unknown.first_offset = unknown.events == 0 ? entry.offset : unknown.first_offset;
    ++unknown.events;
    return;
  }
  if (const auto announced = announced_.find(channel);
      announced != announced_.end() && announced->second != fingerprint) {
    findings.push_back(
        {entry.offset, channel, fmt::format("is a {}, not what the opening event announces", type->name)});
  }
  if (const auto json = DecodeToJson(recording_.types, message); !json.ok()) {
    findings.push_back({entry.offset, channel, json.error().message});
    return;
  }
  if (type->IsStream()) {
    const auto header = CheckStreamHeader(message);
    if (header.ok()) {
      AddToStream(channel, entry, *header, findings);
    } else {
      findings.push_back({entry.offset, channel, header.error().message});
    }
  }
}

void MessageCheck::AddToStream(const std::string& channel, const LogEntry& entry, const StreamHeader& header,
                               std::vector<LogFinding>& findings) {
  const auto [place, is_new] = streams_.try_emplace({channel, header.session});
  Stream& stream = place->second;
  if (header.sequence < 1 || (!is_new && header.sequence <= stream.last)) {
    findings.push_back({entry.offset, channel,
                        fmt::format("sequence {} of session {} comes after {}", header.sequence,
                                    header.session, stream.last)});
    return;
  }
  if (!is_new && header.sequence > stream.last + 1) {
    stream.holes.emplace_back(stream.last + 1, header.sequence - 1);
  }
  stream.last = header.sequence;
}

void MessageCheck::Finish(const std::set<std::string>& doubtful, std::vector<LogFinding>& findings) const {
  for (const auto& [key, unknown] : unknown_) {
    findings.push_back({unknown.first_offset, key.first,
                        fmt::format("{} messages from here on are of the unknown type {:016x}",
                                    unknown.events, key.second)});
  }
  for (const auto& [key, stream] : streams_) {
    for (const auto& [first, last] : stream.holes) {
      if (doubtful.contains(key.first)) {
        findings.push_back({std::nullopt, key.first,
                            fmt::format("sequence {} to {} of session {} are not in the file, or not intact",
                                        first, last, key.second)});
      }
    }
  }
}

}  // namespace forgescan
