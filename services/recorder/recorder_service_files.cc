// What the recorder says in its files and of itself.
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_options.h"
#include "services/common/log/message_definitions.h"
#include "services/recorder/gaps.h"
#include "services/recorder/recorder_service.h"

namespace forgescan {
namespace {

// A status that was on its way before the last message of a part says nothing of it.
constexpr std::int64_t kStatusMarginUs = 100'000;

}  // namespace

fsmsg::recording_opened_t RecorderService::OpeningEvent(const OpenRecording& open) const {
  fsmsg::recording_opened_t opened{};
  opened.utime = open.utime;
  opened.part = open.part.value_or(-1);
  opened.volume = open.volume;
  opened.station = station_.name;
  opened.version = station_.version;
  opened.build = station_.build;
  opened.config_hash = station_.config_hash;
  for (const ChannelInfo& channel : channels_) {
    fsmsg::recorded_channel_t entry{};
    entry.channel = channel.name;
    entry.type = channel.type;
    entry.fingerprint = channel.fingerprint;
    opened.channels.push_back(entry);
  }
  opened.channel_count = static_cast<std::int32_t>(opened.channels.size());
  opened.types = AllMessageDefinitions();
  return opened;
}

void RecorderService::Perform(const OpenRecording& open) {
  OpenFile& file = files_[open.file];
  file.name.utime = open.utime;
  file.name.part = open.part;
  for (const ChannelInfo& channel : channels_) {
    if (channel.kind == ChannelKind::kStream && hub_.Standing(channel.name).session == 0) {
      file.unheard.emplace_back(channel.name);
    }
  }
  monitor_.Count(open.part.has_value() ? "parts_opened" : "volumes_opened");
  writer_.Open(open.file, store_.PathOf(file.name), OpeningEvent(open), station_.files);
}

// A sender that was there before the recorder may have spoken before it was heard.
void RecorderService::AddUnheard(const OpenFile& file, std::vector<fsmsg::recording_gap_t>& gaps) const {
  for (const char* channel : file.unheard) {
    const StreamStanding standing = hub_.Standing(channel);
    if (standing.joined_at > 1) {
      fsmsg::recording_gap_t gap = GapOf(channel, "sent before the recorder listened");
      gap.session = standing.joined_session;
      gap.first_sequence = 1;
      gap.last_sequence = standing.joined_at - 1;
      gaps.push_back(gap);
    }
  }
}

void RecorderService::Perform(const CloseRecording& close) {
  const auto found = files_.find(close.file);
  if (found == files_.end()) {
    return;
  }
  fsmsg::recording_closed_t closed{};
  closed.utime = close.utime;
  closed.part = close.part.value_or(-1);
  closed.verdict = close.verdict;
  closed.reason = close.reason;
  closed.gaps = close.gaps;
  AddUnheard(found->second, closed.gaps);
  RecordingName name = found->second.name;
  name.verdict = close.verdict;
  files_.erase(found);
  writer_.Close(close.file, name, std::move(closed));
}

void RecorderService::Take(const WriterReport& report) {
  if (const auto* opened = std::get_if<FileOpened>(&report)) {
    machine_.OnOpened(opened->file);
  } else if (const auto* failed = std::get_if<FileFailed>(&report)) {
    monitor_.Count("write_failures");
    monitor_.ReportError(Fail(ErrorCode::kIo, "{}", failed->reason));
    files_.erase(failed->file);
    machine_.OnFailed(failed->file, failed->reason, Now());
  } else if (const auto* closed = std::get_if<FileClosed>(&report)) {
    const bool part = closed->part;
    machine_.OnClosed(closed->file);
    monitor_.Count(!part ? "volumes_closed" : closed->gaps == 0 ? "parts_complete" : "parts_incomplete");
    pruned_us_ = part ? 0 : pruned_us_;  // there is one more to choose from
  } else if (const auto* note = std::get_if<WriterNote>(&report)) {
    if (note->what == WriterNote::What::kDeleted) {
      monitor_.Count("recordings_deleted");
      spdlog::info("{}", note->text);
    } else {
      monitor_.ReportError(Fail(ErrorCode::kIo, "{}", note->text));
    }
  }
}

// Everything sent before has been received or given up: no stream waits, and each sender has said since what
// it has sent. One that is silent as long as a stream waits at most has nothing more to say.
std::int64_t RecorderService::SettledUs() const {
  std::int64_t settled_us = std::numeric_limits<std::int64_t>::max();
  for (const ChannelInfo& channel : channels_) {
    const StreamStanding standing = hub_.Standing(channel.name);
    if (standing.waiting()) {
      return 0;
    }
    const bool silent = Now() - standing.heard_us > StreamOptions{}.give_up_us;
    if (standing.session != 0 && !silent) {
      settled_us = std::min(settled_us, standing.told_us);
    }
  }
  const std::int64_t margin_us = done_ == nullptr ? kStatusMarginUs : 0;  // while stopping they say no more
  return settled_us == std::numeric_limits<std::int64_t>::max() ? settled_us : settled_us - margin_us;
}

std::string RecorderService::Trouble() const {
  const std::string trouble = machine_.Trouble();
  if (trouble.empty() && dropping_) {
    return fmt::format("the disk is too slow: {} MB wait to be written, {} MB are the limit",
                       writer_.backlog_bytes() / 1'000'000, config_.backlog_mb);
  }
  return trouble;
}

void RecorderService::PublishState() {
  fsmsg::recorder_state_t state{};
  state.utime = Now();
  state.reason = Trouble();
  state.status = state.reason.empty() ? fsmsg::recorder_state_t::STATUS_RECORDING
                                      : fsmsg::recorder_state_t::STATUS_STOPPED;
  state.free_bytes = free_bytes_;
  state.backlog_bytes = writer_.backlog_bytes();
  state.open_parts = machine_.open_parts();
  if (const Status sent = forgescan::PublishState(hub_.bus(), kRecorderState, state); !sent.ok()) {
    monitor_.ReportError(sent.error());
  }
}

void RecorderService::ShowState() {
  const std::string trouble = Trouble();
  const bool changed = trouble.empty() != shown_trouble_.empty();
  shown_trouble_ = trouble;
  monitor_.SetState(!trouble.empty()            ? (started_ ? ServiceState::kError : ServiceState::kStarting)
                    : machine_.open_parts() > 0 ? ServiceState::kWorking
                                                : ServiceState::kReady,
                    trouble.empty() ? machine_.Text() : trouble);
  started_ = started_ || trouble.empty();
  if (changed) {
    PublishState();
  }
}

}  // namespace forgescan
