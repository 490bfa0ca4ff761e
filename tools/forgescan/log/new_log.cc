#include "tools/forgescan/log/new_log.h"

#include <algorithm>
#include <filesystem>

#include "fsmsg/verdict_t.hpp"
#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/new_file.h"
#include "services/recorder/gaps.h"

namespace forgescan {

namespace fs = std::filesystem;

namespace {

// So that the closing event fits into a log, whatever the source says.
constexpr std::size_t kMaxGaps = 10'000, kMaxReasonBytes = 1000;

}  // namespace

Result<NewLog> NewLog::Create(const Recording& source, const std::string& path) {
  ASSIGN_OR_RETURN(LogWriter writer, LogWriter::Create(path, StagedEnding()));
  return NewLog(source, std::move(writer));
}

NewLog::NewLog(const Recording& source, LogWriter writer) : source_(source), writer_(std::move(writer)) {
  gaps_ = source.closed ? source.closed->gaps : gaps_;
  const std::string name = fs::path(source.log.path()).filename();
  for (const LogDamage& damage : source.log.damage()) {
    AddGap("", fmt::format("{} bytes at byte {} of {} were damaged: {}", damage.bytes, damage.offset, name,
                           damage.what));
  }
  if (!source.closed) {
    AddGap("", fmt::format("{} has no closing event", name));
  }
}

NewLog::NewLog(NewLog&& other) noexcept
    : source_(other.source_),
      writer_(std::move(other.writer_)),
      totals_(std::move(other.totals_)),
      verdicts_(std::move(other.verdicts_)),
      gaps_(std::move(other.gaps_)),
      last_utime_(other.last_utime_),
      is_open_(std::exchange(other.is_open_, false)) {}

NewLog::~NewLog() {
  std::error_code ignored;
  if (is_open_) {
    fs::remove(writer_.open_path(), ignored);
  }
}

Status NewLog::Copy(const LogEntry& entry, ByteView message) {
  const std::string& channel = source_.log.ChannelOf(entry);
  totals_.Add(channel, message);
  last_utime_ = entry.utime;
  if (channel == kVerdict.name) {
    const auto verdict = Decode<fsmsg::verdict_t>(message);
    if (verdict.ok()) {
      verdicts_[verdict->part] = verdict->verdict;
    }
  }
  return writer_.Write(channel, entry.utime, message);
}

void NewLog::AddGap(const std::string& channel, const std::string& reason) {
  gaps_.push_back(GapOf(channel, reason));
}

void NewLog::AddChangedChannels() {
  const std::vector<fsmsg::channel_total_t> copied = totals_.Totals();
  for (const auto& said : source_.closed ? source_.closed->channels : std::vector<fsmsg::channel_total_t>()) {
    const auto is = std::find_if(copied.begin(), copied.end(),
                                 [&said](const auto& total) { return total.channel == said.channel; });
    if (is != copied.end() && is->events >= said.events &&
        (is->events != said.events || is->bytes != said.bytes || is->crc32 != said.crc32)) {
      AddGap(said.channel, "some of the events are not what was recorded, it is not known which");
    }
  }
}

std::vector<fsmsg::recording_gap_t> NewLog::ShortGaps() const {
  const auto shown = static_cast<std::ptrdiff_t>(std::min(gaps_.size(), kMaxGaps));
  std::vector<fsmsg::recording_gap_t> gaps(gaps_.begin(), gaps_.begin() + shown);
  for (fsmsg::recording_gap_t& gap : gaps) {
    gap.channel.resize(std::min(gap.channel.size(), kMaxLogChannelBytes));
    gap.reason.resize(std::min(gap.reason.size(), kMaxReasonBytes));
  }
  if (gaps.size() < gaps_.size()) {
    gaps.emplace_back();
    gaps.back().reason = fmt::format("{} gaps more, which are not listed", gaps_.size() - kMaxGaps);
  }
  return gaps;
}

Status NewLog::Close(const std::string& reason) {
  AddChangedChannels();
  fsmsg::recording_closed_t closed{};
  closed.utime = last_utime_;
  closed.part = source_.closed ? source_.closed->part : source_.opened ? source_.opened->part : -1;
  const auto verdict = verdicts_.find(closed.part);
  closed.verdict = source_.closed               ? source_.closed->verdict
                   : verdict != verdicts_.end() ? verdict->second
                                                : std::int8_t{fsmsg::verdict_t::VERDICT_UNKNOWN};
  closed.reason = reason;
  closed.channels = totals_.Totals();
  closed.channel_count = static_cast<std::int32_t>(closed.channels.size());
  closed.gaps = ShortGaps();
  closed.gap_count = static_cast<std::int32_t>(closed.gaps.size());
  RETURN_IF_ERROR(writer_.Write(kRecordingClosed.name, closed.utime, Encode(closed)));
  RETURN_IF_ERROR(writer_.Close());
  is_open_ = false;
  return {};
}

}  // namespace forgescan
