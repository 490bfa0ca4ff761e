#include "tools/forgescan/log/log_repair.h"

#include <filesystem>
#include <map>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_header.h"
#include "services/common/log/lcm_decode.h"
#include "tools/forgescan/log/new_log.h"
#include "tools/forgescan/log/progress.h"
#include "tools/forgescan/log/shown_text.h"

namespace forgescan {
namespace {

// Events of each channel that the closing event counts and the log no longer has.
void AddLostEvents(const Recording& recording, NewLog& out) {
  std::map<std::string, std::int64_t> found;
  for (const LogEntry& entry : recording.log.entries()) {
    ++found[recording.log.ChannelOf(entry)];
  }
  for (const auto& said :
       recording.closed ? recording.closed->channels : std::vector<fsmsg::channel_total_t>()) {
    if (found[said.channel] < said.events) {
      out.AddGap(said.channel, fmt::format("{} of {} events were lost to damage",
                                           said.events - found[said.channel], said.events));
    }
  }
}

// Why a message is left out.
struct Flaw {
  std::string kind;  // of all such messages: "do not decode as NAME"
  std::string what;  // of this one
};

// Nothing for a message that is good, or of an unknown type.
std::optional<Flaw> FlawOf(const LcmTypes& types, ByteView message) {
  if (message.size() < sizeof(std::int64_t)) {
    return Flaw{"are no LCM messages", fmt::format("{} bytes are no LCM message", message.size())};
  }
  const LcmStruct* type = types.TypeOf(message);
  if (type == nullptr) {
    return std::nullopt;
  }
  if (const auto json = DecodeToJson(types, message); !json.ok()) {
    return Flaw{"do not decode as " + type->name, json.error().message};
  }
  const auto header = type->IsStream() ? CheckStreamHeader(message) : StreamHeader();
  return header.ok() ? std::nullopt
                     : std::optional(Flaw{"have a wrong CRC-32 or header", header.error().message});
}

// Counts what is left out: the closing event names each kind once a channel.
class LeftOut {
 public:
  void Add(const std::string& channel, const LogEntry& entry, const Flaw& flaw) {
    ++events_;
    ++counts_[{channel, flaw.kind}];
    fmt::print("{}\n", Shown(fmt::format("left out: event {} at byte {}, {}: {}", entry.number, entry.offset,
                                         channel, flaw.what)));
  }
  std::int64_t events() const { return events_; }
  void AddTo(NewLog& log) const {
    for (const auto& [key, count] : counts_) {
      log.AddGap(key.first, fmt::format("{} messages were left out: they {}", count, key.second));
    }
  }

 private:
  std::int64_t events_ = 0;
  std::map<std::pair<std::string, std::string>, std::int64_t> counts_;  // by channel and kind
};

}  // namespace

Status RepairLog(const std::string& file, const std::string& out) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(file));
  const LogReader& log = recording.log;
  ASSIGN_OR_RETURN(NewLog repaired, NewLog::Create(recording, out));
  AddLostEvents(recording, repaired);
  for (const LogDamage& damage : log.damage()) {
    fmt::print("left out: {} bytes at byte {}: {}\n", damage.bytes, damage.offset, damage.what);
  }
  LeftOut left_out;
  Progress progress(log.file_bytes());
  for (const LogEntry& entry : log.entries()) {
    const std::string& channel = log.ChannelOf(entry);
    if (channel == kRecordingClosed.name) continue;
    ASSIGN_OR_RETURN(const Bytes message, log.Read(entry));
    if (const auto flaw = FlawOf(recording.types, message)) {
      left_out.Add(channel, entry, *flaw);
      continue;
    }
    RETURN_IF_ERROR(repaired.Copy(entry, message));
    progress.At(entry.offset);
  }
  left_out.AddTo(repaired);
  const std::int64_t events = repaired.events();
  RETURN_IF_ERROR(
      repaired.Close(fmt::format("repaired from {}", std::filesystem::path(file).filename().string())));
  fmt::print("{}: {} events and a new closing event; left out: {} events, {} damaged stretches\n", out,
             events, left_out.events(), log.damage().size());
  return {};
}

}  // namespace forgescan
