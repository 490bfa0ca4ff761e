// The station's own recording, and what the machine says of itself.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "services/recorder/gaps.h"
#include "services/recorder/recording_machine.h"

namespace forgescan {
namespace {

constexpr std::int64_t kUsPerDay = 86'400'000'000;
// After the station's recording has failed; doubled each time until one is open again.
constexpr std::int64_t kRetryUs = 10'000'000;
constexpr int kMaxDoublings = 3;

}  // namespace

void RecordingMachine::OpenVolume(std::int64_t now_us, Actions& actions) {
  const std::int32_t volume = station_.volume + 1;
  station_ = {};
  station_.file = ++last_file_;
  station_.volume = volume;
  station_.day = now_us / kUsPerDay;
  actions.emplace_back(OpenRecording{station_.file, now_us, std::nullopt, volume});
}

void RecordingMachine::CloseVolume(const std::string& reason, std::int64_t now_us, Actions& actions) {
  if (station_.written()) {
    actions.emplace_back(
        CloseRecording{station_.file, now_us, std::nullopt, 0, reason, std::exchange(station_.gaps, {})});
    closing_.push_back({station_.file, std::nullopt});
  }
}

void RecordingMachine::RenewVolume(std::int64_t now_us, Actions& actions) {
  const bool due = station_.day != now_us / kUsPerDay ||
                   station_.bytes >= config_.station_volume_mb * std::int64_t{1'000'000};
  if (station_.written() && due) {
    CloseVolume("the next volume follows", now_us, actions);
    OpenVolume(now_us, actions);
    return;
  }
  const std::int64_t pause_us = kRetryUs << std::min(station_.failed_before, kMaxDoublings);
  if (!station_.written() && space_trouble_.empty() && now_us - station_.broken_us >= pause_us) {
    auto gaps = std::move(station_.gaps);
    const int failed_before = station_.failed_before;
    if (failed_before == 0) {  // the others of the chain held nothing
      AddGap(gaps, GapOf("", "the volume before this one broke off: " + station_trouble_));
    }
    OpenVolume(now_us, actions);
    station_.gaps = std::move(gaps);
    station_.failed_before = failed_before + 1;
  }
}

void RecordingMachine::AppendToStation(const RecordedMessage& message, Actions& actions) {
  if (station_.written()) {
    station_.bytes += message.bytes;
    actions.emplace_back(AppendMessage{station_.file});
  }
}

std::string RecordingMachine::Trouble() const {
  if (!space_trouble_.empty()) {
    return space_trouble_;
  }
  if (!station_trouble_.empty()) {
    return station_trouble_;
  }
  if (!closing_trouble_.empty()) {
    return closing_trouble_;
  }
  const auto broken = std::find_if(parts_.begin(), parts_.end(),
                                   [](const Part& part) { return part.writing == Writing::kBroken; });
  return broken != parts_.end() ? broken->trouble : "";
}

int RecordingMachine::open_parts() const {
  return static_cast<int>(
      std::count_if(parts_.begin(), parts_.end(), [](const Part& part) { return part.written(); }));
}

bool RecordingMachine::finishing() const {
  return std::any_of(parts_.begin(), parts_.end(),
                     [](const Part& part) { return part.written() && part.sorted_utime.has_value(); });
}

std::string RecordingMachine::Text() const {
  std::string text;
  for (const Part& part : parts_) {
    if (part.written()) {
      text += fmt::format("{}{}", text.empty() ? "recording part " : ", ", part.part);
    }
  }
  return text.empty() ? "recording; no part is open" : text;
}

}  // namespace forgescan
