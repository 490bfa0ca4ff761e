#include "tools/forgescan/log/event_times.h"

#include <algorithm>
#include <cmath>

#include "services/common/bus/stream_header.h"

namespace forgescan {
namespace {

// Messages are recorded within seconds of their event (a verdict within the minutes of a scan), and a station
// that runs is never silent for longer.
constexpr std::int64_t kStepUs = 10 * 60'000'000LL;

bool FarApart(std::int64_t a_us, std::int64_t b_us) {
  const auto a = static_cast<double>(a_us), b = static_cast<double>(b_us);  // any bits: no overflow
  return std::abs(a - b) > static_cast<double>(kStepUs);
}

// A wrong bit in an event's time: far from its neighbour's and from that of its own message, which begins
// with it. Errors: kIo.
Result<bool> HasWrongTime(const LogReader& log, const LogEntry& event, std::int64_t neighbour_us) {
  if (!FarApart(event.utime, neighbour_us)) {
    return false;
  }
  ASSIGN_OR_RETURN(const Bytes start, log.Read(event, kStreamHeaderBytes));
  const auto utime = StreamUtime(start);
  return !utime.ok() || FarApart(event.utime, *utime);
}

}  // namespace

Result<EventTimes> CheckEventTimes(const LogReader& log) {
  const auto& entries = log.entries();
  EventTimes times;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::int64_t next_us = entries[std::min(i + 1, entries.size() - 1)].utime;
    const std::int64_t neighbour_us = i == 0 ? next_us : times.utimes.back();
    ASSIGN_OR_RETURN(const bool wrong, HasWrongTime(log, entries[i], neighbour_us));
    if (wrong) {
      times.findings.push_back(
          {entries[i].offset, log.ChannelOf(entries[i]),
           fmt::format("event {}: its time, {} us, is minutes off that of its neighbour, {} us", i,
                       entries[i].utime, neighbour_us)});
    }
    const std::int64_t utime = wrong ? neighbour_us : entries[i].utime;
    times.utimes.push_back(i == 0 ? utime : std::max(times.utimes.back(), utime));
  }
  return times;
}

}  // namespace forgescan
