#include "tools/forgescan/log/log_repair.h"

#include <filesystem>
#include <map>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_header.h"
#include "services/common/log/lcm_decode.h"
#include "tools/forgescan/log/new_log.h"
#include "tools/forgescan/log/progress.h"

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

// What is wrong with a message of a known type.
Status CheckMessage(const LcmTypes& types, ByteView message) {
  const LcmStruct* type = types.TypeOf(message);
  if (type == nullptr) {
    return {};
  }
  const auto json = DecodeToJson(types, message);
  if (!json.ok()) {
    return json.error();
  }
  const auto header = type->IsStream() ? CheckStreamHeader(message) : StreamHeader();
  return header.ok() ? Status() : Status(header.error());
}

}  // namespace

Status RepairLog(const std::string& file, const std::string& out) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(file));
  const LogReader& log = recording.log;
  ASSIGN_OR_RETURN(NewLog repaired, NewLog::Create(recording, out));
  AddLostEvents(recording, repaired);
  for (const LogDamage& damage : log.damage()) {
    fmt::print("left out: {} bytes at byte {}: {}\n", damage.bytes, damage.offset, damage.what);
  }
  std::size_t left_out = 0;
  Progress progress(log.file_bytes());
  for (const LogEntry& entry : log.entries()) {
    const std::string& channel = log.ChannelOf(entry);
    if (channel == kRecordingClosed.name) continue;
    ASSIGN_OR_RETURN(const Bytes message, log.Read(entry));
    if (const Status status = CheckMessage(recording.types, message); !status.ok()) {
      ++left_out;
      repaired.AddGap(channel, status.error().message);
      fmt::print("left out: event {} at byte {}, {}: {}\n", entry.number, entry.offset, channel,
                 status.error().message);
      continue;
    }
    RETURN_IF_ERROR(repaired.Copy(entry, message));
    progress.At(entry.offset);
  }
  const std::int64_t events = repaired.events();
  RETURN_IF_ERROR(
      repaired.Close(fmt::format("repaired from {}", std::filesystem::path(file).filename().string())));
  fmt::print("{}: {} events and a new closing event; left out: {} events, {} damaged stretches\n", out,
             events, left_out, log.damage().size());
  return {};
}

}  // namespace forgescan
