#include "services/recorder/gaps.h"

#include <algorithm>
#include <utility>

namespace forgescan {

fsmsg::recording_gap_t GapOf(std::string channel, std::string reason) {
  fsmsg::recording_gap_t gap{};
  gap.channel = std::move(channel);
  gap.reason = std::move(reason);
  return gap;
}

void AddGap(std::vector<fsmsg::recording_gap_t>& gaps, const fsmsg::recording_gap_t& gap) {
  const auto same = [&](const fsmsg::recording_gap_t& other) {
    const bool numbered = gap.first_sequence != 0;
    return other.channel == gap.channel && other.session == gap.session && other.reason == gap.reason &&
           numbered == (other.first_sequence != 0) &&
           (!numbered || other.last_sequence + 1 == gap.first_sequence);
  };
  const auto found = std::find_if(gaps.rbegin(), gaps.rend(), same);
  if (found == gaps.rend()) {
    gaps.push_back(gap);
  } else {
    found->last_sequence = gap.last_sequence;
  }
}

}  // namespace forgescan
