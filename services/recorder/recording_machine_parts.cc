// Which part a message is of, and what is known of a part from its messages.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "services/recorder/gaps.h"
#include "services/recorder/recording_machine.h"

namespace forgescan {
namespace {

using Kind = RecordedMessage::Kind;

// More parts are not in the cell at the same time: the oldest is then closed.
constexpr std::size_t kMaxOpenParts = 8;

}  // namespace

// The files a message may belong to have its number; it is of the newest that had arrived by then. Before its
// PART_ARRIVED has come, a part is known by its number alone.
RecordingMachine::Part* RecordingMachine::PartOf(const RecordedMessage& message) {
  const auto judged = std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) {
    return part.part == *message.part && part.verdict_us.has_value() && !part.sorted_utime.has_value();
  });
  if (message.kind == Kind::kSorted && judged != parts_.end()) {
    return &*judged;  // sorted after the next part with this number has arrived
  }
  for (auto part = parts_.rbegin(); part != parts_.rend(); ++part) {
    if (part->part == *message.part && Belongs(*part, message)) {
      return &*part;
    }
  }
  return nullptr;
}

bool RecordingMachine::Belongs(const Part& part, const RecordedMessage& message) const {
  if (message.kind == Kind::kArrived) {
    return part.arrived_utime.has_value() ? *part.arrived_utime == message.utime
                                          : message.utime <= part.first_utime;
  }
  const bool before = part.arrived_utime.has_value() && message.utime < *part.arrived_utime;
  const bool oldest = std::none_of(parts_.begin(), parts_.end(), [&](const Part& other) {
    return other.part == part.part && other.file < part.file;
  });
  const bool after = part.sorted_utime.has_value() && message.utime > *part.sorted_utime;
  return !after && (!before || oldest);
}

// An arrival says itself which part it is of; everything else is told by time.
bool RecordingMachine::IsLate(const RecordedMessage& message) {
  ClosedPart* closed = closed_.Find(*message.part);
  if (closed == nullptr) {
    return false;
  }
  const bool late = message.kind != Kind::kArrived      ? message.utime <= closed->until_utime
                    : closed->arrived_utime.has_value() ? message.utime == *closed->arrived_utime
                                                        : message.utime <= closed->first_utime;
  if (late) {
    closed->latest_news = std::max(closed->latest_news.value_or(message.utime), message.utime);
  }
  return late;
}

void RecordingMachine::NoteMixing(Part& part, const RecordedMessage& message) {
  const ClosedPart* closed = closed_.Find(part.part);
  if (closed != nullptr && closed->latest_news.value_or(message.utime - 1) >= message.utime) {
    part.gaps.push_back(GapOf("", "messages may be in the station's recording: a clock was set back"));
  }
  bool mixed = false;
  for (Part& other : parts_) {
    if (other.part != part.part) {
      continue;
    }
    mixed = mixed || other.last_utime >= message.utime;
    if (message.kind == Kind::kArrived && message.utime < other.arrived_utime.value_or(message.utime)) {
      AddGap(other.gaps, GapOf("",
                               "messages may be in the recording of the next part with this number: a clock "
                               "was set back"));
    }
  }
  if (mixed) {
    part.gaps.push_back(GapOf("", "messages may be in the recording of an earlier part with this number"));
  }
}

RecordingMachine::Part& RecordingMachine::OpenPart(const RecordedMessage& message, Actions& actions) {
  if (parts_.size() >= kMaxOpenParts) {
    Part oldest = std::move(parts_.front());
    parts_.erase(parts_.begin());
    oldest.gaps.push_back(GapOf("", "the part was not finished"));
    ClosePart(std::move(oldest), fmt::format("more than {} parts were open", kMaxOpenParts), message.now_us,
              actions);
  }
  Part part;
  part.file = ++last_file_;
  part.part = *message.part;
  part.first_utime = part.last_utime = message.utime;
  NoteMixing(part, message);
  if (space_trouble_.empty()) {
    actions.emplace_back(OpenRecording{part.file, message.now_us, part.part, 0});
  } else {
    part.writing = Writing::kRefused;
    const std::string text = fmt::format("part {} is not recorded: {}", part.part, space_trouble_);
    AddGap(station_.gaps, GapOf("", text));
    actions.emplace_back(RecordingNote{RecordingNote::What::kNotRecorded, text});
  }
  return parts_.emplace_back(std::move(part));
}

void RecordingMachine::Note(Part& part, const RecordedMessage& message) const {
  part.last_us = message.now_us;
  const std::int64_t until_utime = std::max(part.last_utime, message.utime);
  part.first_utime = std::min(part.first_utime, message.utime);
  part.last_utime = until_utime;
  if (message.kind == Kind::kArrived) {
    part.arrived_utime = message.utime;
  } else if (message.kind == Kind::kJudged) {
    part.verdict = message.verdict;
    part.verdict_us = message.now_us;
  } else if (message.kind == Kind::kSorted) {
    part.sorted_utime = until_utime;
    if (message.utime < until_utime) {
      AddGap(part.gaps,
             GapOf("",
                   "the part was sorted before what had come of it: a clock was set back, and messages "
                   "may be in other recordings"));
    }
  }
}

}  // namespace forgescan
