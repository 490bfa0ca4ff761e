#include "tools/forgescan/log/recording.h"

#include <array>
#include <ctime>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/log/message_definitions.h"

namespace forgescan {
namespace {

// The last message on the channel that decodes.
template <typename Message>
std::optional<Message> Last(const LogReader& log, const LogChannel<Message>& channel) {
  for (auto entry = log.entries().rbegin(); entry != log.entries().rend(); ++entry) {
    if (log.ChannelOf(*entry) != channel.name) {
      continue;
    }
    const auto bytes = log.Read(*entry);
    auto message = bytes.ok() ? Decode<Message>(*bytes) : bytes.error();
    if (message.ok()) {
      return std::move(*message);
    }
  }
  return std::nullopt;
}

}  // namespace

Result<Recording> OpenRecording(const std::string& path) {
  ASSIGN_OR_RETURN(LogReader log, LogReader::Open(path));
  Recording recording{std::move(log), {}, "", std::nullopt, std::nullopt};
  recording.opened = Last(recording.log, kRecordingOpened);
  recording.closed = Last(recording.log, kRecordingClosed);
  if (recording.opened) {
    auto types = LcmTypes::Parse(recording.opened->types);
    if (types.ok()) {
      recording.types = std::move(*types);
      return recording;
    }
    recording.types_problem = types.error().message;
  }
  ASSIGN_OR_RETURN(recording.types, LcmTypes::Parse(AllMessageDefinitions()));
  return recording;
}

std::string GapText(const fsmsg::recording_gap_t& gap) {
  const std::string session = gap.session == 0 ? "" : fmt::format(" of session {}", gap.session);
  return gap.first_sequence == 0 && gap.last_sequence == 0
             ? gap.reason
             : fmt::format("sequence {} to {}{}: {}", gap.first_sequence, gap.last_sequence, session,
                           gap.reason);
}

std::string VerdictName(int verdict) {
  constexpr std::array<const char*, 5> kNames{"UNKNOWN", "OK", "NOT_OK", "NOT_DECIDABLE", "NOT_INSPECTED"};
  return verdict >= 0 && verdict < 5 ? kNames[static_cast<std::size_t>(verdict)] : fmt::format("{}", verdict);
}

std::string TimeText(std::int64_t utime) {
  // Rounded down, also before 1970.
  const std::int64_t second = utime / 1'000'000 - (utime % 1'000'000 < 0 ? 1 : 0);
  const std::time_t time = second;
  std::tm parts{};
  std::array<char, 40> text{};
  if (gmtime_r(&time, &parts) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &parts) == 0) {
    return fmt::format("{} us", utime);  // beyond any calendar
  }
  return fmt::format("{}.{:03} UTC", text.data(), (utime - second * 1'000'000) / 1000);
}

}  // namespace forgescan
