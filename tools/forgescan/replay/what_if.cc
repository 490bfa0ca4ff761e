#include "tools/forgescan/replay/what_if.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_header.h"

namespace forgescan {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::int8_t kUnknown = fsmsg::verdict_t::VERDICT_UNKNOWN;

DimensionChange& Dimension(const std::string& name, PartChange& change) {
  const auto known = std::find_if(change.dimensions.begin(), change.dimensions.end(),
                                  [&name](const auto& other) { return other.name == name; });
  return known != change.dimensions.end()
             ? *known
             : change.dimensions.emplace_back(
                   DimensionChange{name, kNone, kNone, kNone, kNone, kNone, kNone, kUnknown, kUnknown});
}

// A verdict that is said again takes the place of the one before.
void AddRecorded(const fsmsg::verdict_t& verdict, PartChange& change) {
  change.recorded_verdict = verdict.verdict;
  change.recorded_reason = verdict.reason;
  for (const auto& d : verdict.dimensions) {
    DimensionChange& dimension = Dimension(d.name, change);
    dimension.lower_mm = d.lower_mm;
    dimension.upper_mm = d.upper_mm;
    dimension.recorded_mm = d.measured_mm;
    dimension.recorded_u_mm = d.uncertainty_mm;
    dimension.recorded_verdict = d.verdict;
  }
}

void AddNow(const fsmsg::verdict_t& verdict, PartChange& change) {
  change.now_verdict = verdict.verdict;
  change.now_reason = verdict.reason;
  for (const auto& d : verdict.dimensions) {
    DimensionChange& dimension = Dimension(d.name, change);
    dimension.lower_mm = d.lower_mm;
    dimension.upper_mm = d.upper_mm;
    dimension.now_mm = d.measured_mm;
    dimension.now_u_mm = d.uncertainty_mm;
    dimension.now_verdict = d.verdict;
  }
}

}  // namespace

Result<std::vector<fsmsg::verdict_t>> RecordedVerdicts(const RecordedSession& session) {
  std::vector<fsmsg::verdict_t> verdicts;
  for (const RecordedEvent& event : session.events()) {
    if (session.ChannelOf(event) == kVerdict.name) {
      ASSIGN_OR_RETURN(const Bytes message, session.Read(event));
      auto verdict = Decode<fsmsg::verdict_t>(message);
      if (verdict.ok() && CheckStreamHeader(message).ok()) {
        verdicts.push_back(std::move(*verdict));
      }
    }
  }
  return verdicts;
}

std::vector<PartChange> CompareVerdicts(const std::vector<fsmsg::verdict_t>& recorded,
                                        const std::vector<fsmsg::verdict_t>& now) {
  std::map<std::pair<std::int64_t, int>, PartChange> parts;  // by utime, number
  const auto find = [&parts](const fsmsg::verdict_t& verdict) -> PartChange& {
    PartChange& change = parts[{verdict.utime, verdict.part}];
    change.part = verdict.part;
    change.utime = verdict.utime;
    return change;
  };
  for (const auto& verdict : recorded) {
    AddRecorded(verdict, find(verdict));
  }
  for (const auto& verdict : now) {
    AddNow(verdict, find(verdict));
  }
  std::vector<PartChange> changes;
  for (auto& [key, change] : parts) {
    changes.push_back(std::move(change));
  }
  return changes;
}

}  // namespace forgescan
