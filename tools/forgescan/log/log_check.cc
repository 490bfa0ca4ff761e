#include "tools/forgescan/log/log_check.h"

#include <algorithm>

#include "tools/forgescan/log/closing_check.h"
#include "tools/forgescan/log/event_times.h"
#include "tools/forgescan/log/message_check.h"
#include "tools/forgescan/log/progress.h"

namespace forgescan {
namespace {

void CheckDamage(const LogReader& log, std::vector<LogFinding>& findings) {
  for (const LogDamage& damage : log.damage()) {
    findings.push_back(
        {damage.offset, "", fmt::format("{} bytes are damaged: {}", damage.bytes, damage.what)});
  }
}

// LCM numbers the events of a file 0, 1, 2, ...; what damage explains has been said.
void CheckNumbers(const LogReader& log, std::vector<LogFinding>& findings) {
  std::uint64_t end = 0;
  std::int64_t last = -1;
  for (const LogEntry& entry : log.entries()) {
    const auto step = static_cast<std::uint64_t>(entry.number) - static_cast<std::uint64_t>(last);
    if (entry.offset == end && step != 1) {
      findings.push_back({entry.offset, log.ChannelOf(entry),
                          last < 0 ? fmt::format("the first event has the number {}, not 0", entry.number)
                                   : fmt::format("event {} follows event {}", entry.number, last)});
    }
    end = log.EndOf(entry);
    last = entry.number;
  }
}

}  // namespace

Result<std::vector<LogFinding>> CheckLog(const Recording& recording) {
  const LogReader& log = recording.log;
  std::vector<LogFinding> findings;
  CheckDamage(log, findings);
  CheckNumbers(log, findings);
  if (recording.opened.has_value()) {
    ASSIGN_OR_RETURN(const EventTimes times, CheckEventTimes(log));
    findings.insert(findings.end(), times.findings.begin(), times.findings.end());
  }
  MessageCheck messages(recording);
  ClosingCheck closing(recording);
  Progress progress(log.file_bytes());
  for (const LogEntry& entry : log.entries()) {
    ASSIGN_OR_RETURN(const Bytes message, log.Read(entry));
    messages.Add(entry, message, findings);
    closing.Add(entry, message, findings);
    progress.At(entry.offset);
  }
  std::stable_sort(findings.begin(), findings.end(),
                   [](const LogFinding& a, const LogFinding& b) { return *a.offset < *b.offset; });
  messages.Finish(closing.DoubtfulChannels(), findings);
  closing.Finish(findings);
  return findings;
}

}  // namespace forgescan
