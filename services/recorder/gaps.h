// What a recording lacks, as entries of its closing event. Pure.
#pragma once

#include <string>
#include <vector>

#include "fsmsg/recording_gap_t.hpp"

namespace forgescan {

// Of messages that cannot be numbered. channel: empty = of any channel.
fsmsg::recording_gap_t GapOf(std::string channel, std::string reason);

// Keeps the list short: neighbours of one stream become one entry, and the same sentence is said once.
void AddGap(std::vector<fsmsg::recording_gap_t>& gaps, const fsmsg::recording_gap_t& gap);

}  // namespace forgescan
