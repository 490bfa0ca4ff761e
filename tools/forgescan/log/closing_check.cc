#include "tools/forgescan/log/closing_check.h"

#include <libdeflate.h>

#include <map>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"

namespace forgescan {
namespace {

std::map<std::string, fsmsg::channel_total_t> ByChannel(const std::vector<fsmsg::channel_total_t>& totals) {
  std::map<std::string, fsmsg::channel_total_t> by_channel;
  for (const fsmsg::channel_total_t& total : totals) {
    by_channel[total.channel] = total;
  }
  return by_channel;
}

std::string Text(const fsmsg::channel_total_t& total) {
  return fmt::format("{} events with {} bytes and CRC-32 {:08x}", total.events, total.bytes,
                     static_cast<std::uint32_t>(total.crc32));
}

}  // namespace

void ClosingCheck::Add(const LogEntry& entry, ByteView message, std::vector<LogFinding>& findings) {
  const std::string& channel = recording_.log.ChannelOf(entry);
  if (channel == kRecordingClosed.name) {
    if (is_closed_) {
      findings.push_back({entry.offset, channel, "closes the recording a second time"});
    }
    is_closed_ = true;
    return;
  }
  if (is_closed_) {
    ++after_closing_;
    return;
  }
  totals_.Add(channel, message);
  if (channel == kRecordedFile.name) {
    CheckRecordedFile(entry, message, findings);
  } else if (channel == kVerdict.name) {
    const auto verdict = Decode<fsmsg::verdict_t>(message);
    if (verdict.ok()) {
      verdicts_[verdict->part] = verdict->verdict;
    }
  }
}

void ClosingCheck::CheckRecordedFile(const LogEntry& entry, ByteView message,
                                     std::vector<LogFinding>& findings) {
  ++recorded_files_;
  const auto file = Decode<fsmsg::recorded_file_t>(message);
  if (!file.ok()) {
    return;  // MessageCheck says so
  }
  const std::uint32_t crc =
      file->data.empty() ? 0 : libdeflate_crc32(0, file->data.data(), file->data.size());
  if (crc != static_cast<std::uint32_t>(file->crc32)) {
    findings.push_back({entry.offset, kRecordedFile.name,
                        fmt::format("{} has the CRC-32 {:08x}, not {:08x}", file->name, crc,
                                    static_cast<std::uint32_t>(file->crc32))});
  }
}

std::vector<ClosingCheck::Difference> ClosingCheck::Differences() const {
  std::vector<Difference> differences;
  if (!recording_.closed) {
    return differences;
  }
  auto found = ByChannel(totals_.Totals());
  for (const auto& [channel, said] : ByChannel(recording_.closed->channels)) {
    const std::string is = found.contains(channel) ? Text(found[channel]) : "none";
    found.erase(channel);
    if (is != Text(said)) {
      differences.push_back(
          {channel, fmt::format("the closing event counts {}, the file has {}", Text(said), is)});
    }
  }
  for (const auto& [channel, is] : found) {
    differences.push_back({channel, fmt::format("the closing event counts none, the file has {}", Text(is))});
  }
  return differences;
}

std::set<std::string> ClosingCheck::DoubtfulChannels() const {
  std::set<std::string> channels;
  for (const Difference& difference : Differences()) {
    channels.insert(difference.channel);
  }
  if (recording_.closed) {
    for (const fsmsg::recording_gap_t& gap : recording_.closed->gaps) {
      channels.insert(gap.channel);
    }
  }
  return channels;
}

void ClosingCheck::Finish(std::vector<LogFinding>& findings) const {
  const auto add = [&findings](const std::string& channel, const std::string& what) {
    findings.push_back({std::nullopt, channel, what});
  };
  if (!recording_.opened) {
    add(kRecordingOpened.name, "is missing: nothing says where this log comes from");
  } else if (recording_.log.ChannelOf(recording_.log.entries().front()) != kRecordingOpened.name) {
    add(kRecordingOpened.name, "is not the first event");
  }
  if (!recording_.types_problem.empty()) {
    add(kRecordingOpened.name, "has types that cannot be used: " + recording_.types_problem);
  }
  if (recording_.opened && recording_.opened->file_count != recorded_files_) {
    add(kRecordedFile.name, fmt::format("{} files of the station were recorded, the file has {}",
                                        recording_.opened->file_count, recorded_files_));
  }
  if (!recording_.closed) {
    add(kRecordingClosed.name, "is missing: the recording does not say that it is complete");
    return;
  }
  FinishClosing(*recording_.closed, findings);
}

void ClosingCheck::FinishClosing(const fsmsg::recording_closed_t& closed,
                                 std::vector<LogFinding>& findings) const {
  if (after_closing_ > 0) {
    findings.push_back(
        {std::nullopt, kRecordingClosed.name, fmt::format("{} events follow it", after_closing_)});
  }
  if (recording_.opened && recording_.opened->part != closed.part) {
    findings.push_back(
        {std::nullopt, kRecordingClosed.name,
         fmt::format("closes part {}, part {} was opened", closed.part, recording_.opened->part)});
  }
  if (const auto verdict = verdicts_.find(closed.part);
      verdict != verdicts_.end() && verdict->second != closed.verdict) {
    findings.push_back({std::nullopt, kRecordingClosed.name,
                        fmt::format("says that the verdict is {}, VERDICT says {}",
                                    VerdictName(closed.verdict), VerdictName(verdict->second))});
  }
  for (const Difference& difference : Differences()) {
    findings.push_back({std::nullopt, difference.channel, difference.what});
  }
  for (const fsmsg::recording_gap_t& gap : closed.gaps) {
    findings.push_back({std::nullopt, gap.channel, "the closing event names a gap: " + GapText(gap)});
  }
}

}  // namespace forgescan
