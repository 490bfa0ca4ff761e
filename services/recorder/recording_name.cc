#include "services/recorder/recording_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>

namespace forgescan {
namespace {

constexpr std::string_view kSuffix = ".lcmlog", kOpen = ".part", kIncomplete = "_INCOMPLETE", kPart = "_part";
constexpr std::size_t kTimeLength = 23;  // 20261122T141507.123456Z
constexpr std::array<std::string_view, 5> kVerdicts{"_NO_VERDICT", "_OK", "_NOT_OK", "_NOT_DECIDABLE",
                                                    "_NOT_INSPECTED"};  // by verdict_t.VERDICT_*

std::string TimeText(std::int64_t utime) {
  const std::chrono::sys_time<std::chrono::microseconds> time{std::chrono::microseconds(utime)};
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  return fmt::format("{:04}{:02}{:02}T{:02}{:02}{:02}.{:06}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                     clock.hours().count(), clock.minutes().count(), clock.seconds().count(),
                     clock.subseconds().count());
}

// All of the text is one number without sign.
std::optional<std::int64_t> Number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool digits = !text.empty() && text.front() != '-' && problem == std::errc();
  return digits && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

std::optional<std::int64_t> ParseTime(std::string_view text) {
  if (text.size() != kTimeLength || text[8] != 'T' || text[15] != '.' || text[22] != 'Z') {
    return std::nullopt;
  }
  const auto date = Number(text.substr(0, 8)), clock = Number(text.substr(9, 6)),
             us = Number(text.substr(16, 6));
  if (!date || !clock || !us) {
    return std::nullopt;
  }
  const std::chrono::year_month_day day(std::chrono::year(static_cast<int>(*date / 10'000)),
                                        std::chrono::month(static_cast<unsigned>(*date / 100 % 100)),
                                        std::chrono::day(static_cast<unsigned>(*date % 100)));
  const std::int64_t hour = *clock / 10'000, minute = *clock / 100 % 100, second = *clock % 100;
  if (!day.ok() || hour > 23 || minute > 59 || second > 59) {
    return std::nullopt;
  }
  const std::int64_t days = std::chrono::sys_days(day).time_since_epoch().count();
  return (((days * 24 + hour) * 60 + minute) * 60 + second) * 1'000'000 + *us;
}

// Takes the end off the text if it is there.
bool TakeEnd(std::string_view& text, std::string_view end) {
  const bool there = text.ends_with(end);
  text.remove_suffix(there ? end.size() : 0);
  return there;
}

// "_part000042_OK_INCOMPLETE" and the like, into `name`.
bool ParsePart(std::string_view text, RecordingName& name) {
  if (!text.starts_with(kPart)) {
    return false;
  }
  name.complete = name.closed && !TakeEnd(text, kIncomplete);
  const std::size_t after = text.find('_', kPart.size());
  const std::string_view verdict = after == std::string_view::npos ? "" : text.substr(after);
  const auto found = std::find(kVerdicts.begin(), kVerdicts.end(), verdict);
  const std::string_view digits =
      text.substr(kPart.size(), after == std::string_view::npos ? after : after - kPart.size());
  const auto part = Number(digits);
  if (!part || *part < 1 || *part > INT32_MAX || digits.size() < 6 ||
      name.closed != (found != kVerdicts.end()) || (!name.closed && !verdict.empty())) {
    return false;
  }
  name.part = static_cast<std::int32_t>(*part);
  name.verdict = static_cast<std::int8_t>(name.closed ? found - kVerdicts.begin() : 0);
  return true;
}

}  // namespace

std::string NameOf(const RecordingName& name) {
  std::string text = TimeText(name.utime);
  if (name.part) {
    text += fmt::format("{}{:06}", kPart, *name.part);
  }
  if (name.part && name.closed) {
    const bool known = name.verdict >= 0 && static_cast<std::size_t>(name.verdict) < kVerdicts.size();
    text += kVerdicts[known ? static_cast<std::size_t>(name.verdict) : 0];
    text += name.complete ? "" : kIncomplete;
  }
  return text + std::string(kSuffix) + std::string(name.closed ? "" : kOpen);
}

std::optional<RecordingName> ParseRecordingName(std::string_view text) {
  const std::string_view whole = text;
  RecordingName name;
  name.closed = !TakeEnd(text, kOpen);
  if (!TakeEnd(text, kSuffix) || text.size() < kTimeLength) {
    return std::nullopt;
  }
  const auto utime = ParseTime(text.substr(0, kTimeLength));
  const std::string_view rest = text.substr(kTimeLength);
  if (!utime || !(rest.empty() || ParsePart(rest, name))) {
    return std::nullopt;
  }
  name.utime = *utime;
  name.complete = rest.empty() ? name.closed : name.complete;
  return NameOf(name) == whole ? std::optional(name) : std::nullopt;  // no other spelling of a time or number
}

}  // namespace forgescan
