#include "services/recorder/recording_machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "services/recorder/gaps.h"

namespace forgescan {
namespace {

using Kind = RecordedMessage::Kind;

// More parts are not in the cell at the same time: the oldest is then closed.
constexpr std::size_t kMaxOpenParts = 8;

std::int64_t Us(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }

}  // namespace

RecordingMachine::Actions RecordingMachine::Start(std::int64_t now_us) {
  Actions actions;
  OpenVolume(now_us, actions);
  return actions;
}

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

bool RecordingMachine::IsLate(const RecordedMessage& message) {
  const std::int64_t* until = closed_.Find(*message.part);
  return until != nullptr && message.utime <= *until;
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
  const bool mixed = std::any_of(parts_.begin(), parts_.end(), [&](const Part& other) {
    return other.part == part.part && other.last_utime >= message.utime;
  });
  if (mixed) {
    part.gaps.push_back(GapOf("", "messages may be in the recording of an earlier part with this number"));
  }
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
  part.first_utime = std::min(part.first_utime, message.utime);
  part.last_utime = std::max(part.last_utime, message.utime);
  if (message.kind == Kind::kArrived) {
    part.arrived_utime = message.utime;
  } else if (message.kind == Kind::kJudged) {
    part.verdict = message.verdict;
    part.verdict_us = message.now_us;
  } else if (message.kind == Kind::kSorted) {
    part.sorted_utime = message.utime;
  }
}

RecordingMachine::Actions RecordingMachine::OnMessage(const RecordedMessage& message) {
  Actions actions;
  if (message.kind == Kind::kState) {
    AppendToStation(message, actions);
    for (const Part& part : parts_) {
      if (part.written()) {
        actions.emplace_back(AppendMessage{part.file});
      }
    }
    return actions;
  }
  const bool of_a_part = message.part.has_value() && *message.part >= 1;
  Part* part = of_a_part ? PartOf(message) : nullptr;
  const bool late = of_a_part && part == nullptr && IsLate(message);
  if (!of_a_part || late) {
    if (late) {
      actions.emplace_back(RecordingNote{RecordingNote::What::kLate, ""});
    }
    AppendToStation(message, actions);
    return actions;
  }
  part = part == nullptr ? &OpenPart(message, actions) : part;
  Note(*part, message);
  if (part->written()) {
    actions.emplace_back(AppendMessage{part->file});
  } else {
    actions.emplace_back(RecordingNote{RecordingNote::What::kNotRecorded, ""});
  }
  return actions;
}

void RecordingMachine::OnLost(const fsmsg::recording_gap_t& gap) {
  AddGap(station_.gaps, gap);
  for (Part& part : parts_) {
    AddGap(part.gaps, gap);
  }
}

void RecordingMachine::OnDropped(FileId file, const fsmsg::recording_gap_t& gap) {
  if (file == station_.file) {
    AddGap(station_.gaps, gap);
  }
  for (Part& part : parts_) {
    if (part.file == file) {
      AddGap(part.gaps, gap);
    }
  }
}

void RecordingMachine::OnOpened(FileId file) {
  if (file == station_.file && station_.writing == Writing::kOpening) {
    station_.writing = Writing::kOpen;
    station_trouble_.clear();
  }
  for (Part& part : parts_) {
    if (part.file == file && part.writing == Writing::kOpening) {
      part.writing = Writing::kOpen;
    }
  }
}

void RecordingMachine::OnFailed(FileId file, const std::string& reason, std::int64_t now_us) {
  if (file == station_.file) {
    station_.writing = Writing::kBroken;
    station_trouble_ = reason;
    station_.broken_us = now_us;
  }
  for (Part& part : parts_) {
    if (part.file == file) {
      part.writing = Writing::kBroken;
      part.trouble = reason;
      AddGap(station_.gaps,
             GapOf("", fmt::format("part {} is recorded in part only: {}", part.part, reason)));
    }
  }
}

bool RecordingMachine::Finished(const Part& part, std::int64_t now_us) const {
  const bool unsorted =
      part.verdict_us.has_value() && now_us - *part.verdict_us >= Us(config_.sorted_timeout_s);
  return part.sorted_utime.has_value() || unsorted;
}

bool RecordingMachine::Quiet(const Part& part, std::int64_t now_us, std::int64_t settled_us) const {
  return now_us - part.last_us >= Us(config_.settle_s) && part.last_us <= settled_us;
}

void RecordingMachine::ClosePart(Part part, const std::string& reason, std::int64_t now_us,
                                 Actions& actions) {
  closed_.Insert(part.part, part.sorted_utime.value_or(part.last_utime));
  if (!part.written()) {
    return;  // what there is stays a .part
  }
  if (!part.arrived_utime.has_value()) {
    part.gaps.push_back(GapOf("PART_ARRIVED", "the recording began after the part had arrived"));
  }
  actions.emplace_back(
      CloseRecording{part.file, now_us, part.part, part.verdict, reason, std::move(part.gaps)});
}

RecordingMachine::Actions RecordingMachine::OnTick(std::int64_t now_us, std::int64_t settled_us) {
  Actions actions;
  RenewVolume(now_us, actions);
  for (std::size_t i = 0; i < parts_.size();) {
    Part& part = parts_[i];
    const bool overdue = now_us - part.last_us >= Us(config_.part_timeout_s);
    std::string reason;
    if (Finished(part, now_us) && Quiet(part, now_us, settled_us)) {
      reason = part.sorted_utime.has_value()
                   ? "the part was sorted"
                   : fmt::format("no word of sorting within {} s of the verdict", config_.sorted_timeout_s);
    } else if (overdue) {
      reason = fmt::format("nothing was heard of the part for {} s", config_.part_timeout_s);
      part.gaps.push_back(GapOf("", reason + ", and it was not finished"));
    }
    if (reason.empty()) {
      ++i;
      continue;
    }
    Part closing = std::move(part);
    parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(i));
    ClosePart(std::move(closing), reason, now_us, actions);
  }
  return actions;
}

RecordingMachine::Actions RecordingMachine::OnStop(std::int64_t now_us, std::int64_t settled_us) {
  Actions actions;
  for (Part& part : std::exchange(parts_, {})) {
    if (!Finished(part, now_us) || !Quiet(part, now_us, settled_us)) {
      part.gaps.push_back(GapOf("", "the recorder was stopped before the part was finished"));
    }
    ClosePart(std::move(part), "the recorder was stopped", now_us, actions);
  }
  CloseVolume("the recorder was stopped", now_us, actions);
  return actions;
}

}  // namespace forgescan
