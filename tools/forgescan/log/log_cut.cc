#include "tools/forgescan/log/log_cut.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <regex>

#include "services/common/bus/channels.h"
#include "services/common/log/lcm_decode.h"
#include "tools/forgescan/log/new_log.h"
#include "tools/forgescan/log/progress.h"

namespace forgescan {
namespace {

struct Selection {
  std::int64_t from_us = INT64_MIN, to_us = INT64_MAX;
  std::vector<std::regex> channels;
  std::optional<int> part, view;
};

// The whole text is one number without spaces.
template <typename Number>
std::optional<Number> NumberIn(std::string_view text) {
  Number value{};
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

Result<std::int64_t> ParseTime(const std::string& text, std::int64_t begin_us) {
  constexpr double kMaxSeconds = 1e11;
  if (!text.starts_with('+')) {
    if (const auto utime = NumberIn<std::int64_t>(text)) {
      return *utime;
    }
  } else if (const auto seconds = NumberIn<double>(std::string_view(text).substr(1));
             seconds && !std::signbit(*seconds) && *seconds < kMaxSeconds) {
    std::int64_t utime = 0;
    if (!__builtin_add_overflow(begin_us, std::llround(*seconds * 1e6), &utime)) {
      return utime;
    }
  }
  return Fail(ErrorCode::kInvalidArgument, "\"{}\" is no time: us since 1970, or +SECONDS", text);
}

Result<Selection> Parse(const LogCut& cut, const LogReader& log) {
  Selection selection;
  const std::int64_t begin_us =
      std::min_element(log.entries().begin(), log.entries().end(), [](const auto& a, const auto& b) {
        return a.utime < b.utime;
      })->utime;
  if (cut.from) {
    ASSIGN_OR_RETURN(selection.from_us, ParseTime(*cut.from, begin_us));
  }
  if (cut.to) {
    ASSIGN_OR_RETURN(selection.to_us, ParseTime(*cut.to, begin_us));
  }
  for (const std::string& channel : cut.channels) {
    try {
      selection.channels.emplace_back(channel);
    } catch (const std::regex_error& error) {
      return Fail(ErrorCode::kInvalidArgument, "--channel \"{}\" is no regular expression: {}", channel,
                  error.what());
    }
  }
  selection.part = cut.part;
  selection.view = cut.view;
  return selection;
}

bool IsOpening(const std::string& channel) {
  return channel == kRecordingOpened.name || channel == kRecordedFile.name;
}

bool MayBeSelected(const Selection& selection, const std::string& channel, std::int64_t utime) {
  const bool is_named =
      selection.channels.empty() ||
      std::any_of(selection.channels.begin(), selection.channels.end(),
                  [&](const std::regex& regex) { return std::regex_match(channel, regex); });
  return is_named && utime >= selection.from_us && utime <= selection.to_us;
}

bool IsSelected(const Selection& selection, const LcmTypes& types, ByteView message) {
  if (!selection.part && !selection.view) {
    return true;
  }
  const auto json = DecodeToJson(types, message);
  const auto has = [&json](const char* field, std::optional<int> number) {
    const auto value = json->find(field);
    return !number || (value != json->end() && *value == *number);
  };
  return json.ok() && has("part", selection.part) && has("view", selection.view);
}

}  // namespace

Status CutLog(const LogCut& cut) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(cut.file));
  const LogReader& log = recording.log;
  ASSIGN_OR_RETURN(const Selection selection, Parse(cut, log));
  ASSIGN_OR_RETURN(NewLog out, NewLog::Create(recording, cut.out));
  std::int64_t selected = 0, left_out = 0;
  Progress progress(log.file_bytes());
  for (const LogEntry& entry : log.entries()) {
    const std::string& channel = log.ChannelOf(entry);
    if (channel == kRecordingClosed.name) continue;
    if (!IsOpening(channel) && !MayBeSelected(selection, channel, entry.utime)) {
      ++left_out;
      continue;
    }
    ASSIGN_OR_RETURN(const Bytes message, log.Read(entry));
    const bool is_selected = !IsOpening(channel) && IsSelected(selection, recording.types, message);
    if (is_selected || IsOpening(channel)) {
      RETURN_IF_ERROR(out.Copy(entry, message));
    }
    selected += is_selected ? 1 : 0;
    left_out += is_selected || IsOpening(channel) ? 0 : 1;
    progress.At(entry.offset);
  }
  if (selected == 0) {
    return Fail(ErrorCode::kInvalidArgument, "{}: none of its {} events meets the conditions", cut.file,
                log.entries().size());
  }
  if (left_out > 0) {
    out.AddGap("", fmt::format("{} events were left out on request", left_out));
  }
  RETURN_IF_ERROR(out.Close(fmt::format("cut from {}", std::filesystem::path(cut.file).filename().string())));
  fmt::print("{}: {} events selected, {} left out\n", cut.out, selected, left_out);
  return {};
}

}  // namespace forgescan
