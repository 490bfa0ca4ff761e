#include "services/recorder/recording_machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "services/recorder/gaps.h"

namespace forgescan {
namespace {

using Kind = RecordedMessage::Kind;

// A file that could not be closed is past: long enough for everybody who holds parts back to hear of it.
constexpr std::int64_t kTroubleShownUs = 10'000'000;

std::int64_t Us(double seconds) { return static_cast<std::int64_t>(seconds * 1e6); }

}  // namespace

RecordingMachine::Actions RecordingMachine::Start(std::int64_t now_us) {
  Actions actions;
  OpenVolume(now_us, actions);
  return actions;
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
    station_.failed_before = 0;
  }
  for (Part& part : parts_) {
    if (part.file == file && part.writing == Writing::kOpening) {
      part.writing = Writing::kOpen;
    }
  }
}

void RecordingMachine::OnClosed(FileId file) {
  std::erase_if(closing_, [file](const ClosingFile& closing) { return closing.file == file; });
}

void RecordingMachine::OnClosingFailed(const ClosingFile& closing, const std::string& reason,
                                       std::int64_t now_us) {
  closing_trouble_ = reason;
  closing_trouble_us_ = now_us;
  AddGap(station_.gaps,
         GapOf("", closing.part.has_value() ? fmt::format("the recording of part {} could not be closed: {}",
                                                          *closing.part, reason)
                                            : "the volume before this one could not be closed: " + reason));
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
  const auto closing = std::find_if(closing_.begin(), closing_.end(),
                                    [file](const ClosingFile& one) { return one.file == file; });
  if (closing != closing_.end()) {
    OnClosingFailed(*closing, reason, now_us);
    closing_.erase(closing);
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
  const std::int64_t until_utime = std::max(part.sorted_utime.value_or(part.last_utime), part.last_utime);
  closed_.Insert(part.part, {part.arrived_utime, part.first_utime, until_utime, std::nullopt});
  if (!part.written()) {
    return;  // what there is stays a .part
  }
  if (!part.arrived_utime.has_value()) {
    part.gaps.push_back(GapOf("PART_ARRIVED", "the recording began after the part had arrived"));
  }
  closing_.push_back({part.file, part.part});
  actions.emplace_back(
      CloseRecording{part.file, now_us, part.part, part.verdict, reason, std::move(part.gaps)});
}

RecordingMachine::Actions RecordingMachine::OnTick(std::int64_t now_us, std::int64_t settled_us) {
  Actions actions;
  RenewVolume(now_us, actions);
  if (now_us - closing_trouble_us_ >= kTroubleShownUs) {
    closing_trouble_.clear();
  }
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
  return actions;
}

RecordingMachine::Actions RecordingMachine::OnEnd(std::int64_t now_us) {
  Actions actions;
  CloseVolume("the recorder was stopped", now_us, actions);
  return actions;
}

}  // namespace forgescan
