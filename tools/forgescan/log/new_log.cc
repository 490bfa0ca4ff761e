#include "tools/forgescan/log/new_log.h"

#include <algorithm>
#include <filesystem>

#include "fsmsg/verdict_t.hpp"
#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"

namespace forgescan {

namespace fs = std::filesystem;

Result<NewLog> NewLog::Create(const Recording& source, const std::string& path) {
  ASSIGN_OR_RETURN(LogWriter writer, LogWriter::Create(path));
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
      gaps_(std::move(other.gaps_)),
      last_utime_(other.last_utime_),
      is_open_(std::exchange(other.is_open_, false)) {}

NewLog::~NewLog() {
  std::error_code ignored;
  if (is_open_) {
    fs::remove(writer_.path() + ".part", ignored);
  }
}

Status NewLog::Copy(const LogEntry& entry, ByteView message) {
  const std::string& channel = source_.log.ChannelOf(entry);
  totals_.Add(channel, message);
  last_utime_ = entry.utime;
  return writer_.Write(channel, entry.utime, message);
}

void NewLog::AddGap(const std::string& channel, const std::string& reason) {
  fsmsg::recording_gap_t gap{};
  gap.channel = channel;
  gap.reason = reason;
  gaps_.push_back(gap);
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

Status NewLog::Close(const std::string& reason) {
  AddChangedChannels();
  fsmsg::recording_closed_t closed{};
  closed.utime = last_utime_;
  closed.part = source_.closed ? source_.closed->part : source_.opened ? source_.opened->part : -1;
  closed.verdict = source_.closed ? source_.closed->verdict : fsmsg::verdict_t::VERDICT_UNKNOWN;
  closed.reason = reason;
  closed.channels = totals_.Totals();
  closed.channel_count = static_cast<std::int32_t>(closed.channels.size());
  closed.gaps = gaps_;
  closed.gap_count = static_cast<std::int32_t>(closed.gaps.size());
  RETURN_IF_ERROR(writer_.Write(kRecordingClosed.name, closed.utime, Encode(closed)));
  RETURN_IF_ERROR(writer_.Close());
  is_open_ = false;
  return {};
}

}  // namespace forgescan
