// Finds the events in a log file, whatever has happened to it.
//
// An event is believed when its header is credible (log_header.h), it ends within the file, and what follows
// is the end of the file or another credible header; where no event is expected, the numbers of the two must
// be in order too: a *sound* event. Pixels that happen to contain a sync word are not. An event that is not
// followed so may still be good, with damage behind it, or its length may be wrong; other events within its
// extent, and the numbers of the events behind it, decide which.
//
// A channel's name that is not pure ASCII is believed where an event is expected, if the next event or the
// end of the file follows; not where events are searched for.
//
// Cost: linear in the file where it is damaged, one small read an event where it is not. Doubts about lengths
// are looked into as long as that costs no more than kDoubtPerByte passes over the file; in a file that is
// made to raise more, an event's length is then taken as it stands.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "services/common/log/file_window.h"
#include "services/common/log/log_header.h"
#include "services/common/log/log_reader.h"

namespace forgescan {

struct LogIndex {
  std::vector<LogEntry> entries;
  std::vector<LogDamage> damage;
  std::vector<std::string> channels;
};

class LogScanner {
 public:
  LogScanner(int fd, std::uint64_t file_bytes);

  // Once. Errors: kIo.
  Result<LogIndex> Run();

 private:
  // The credible header at this place of the file, if there is one.
  std::optional<LogHeader> HeaderAt(FileWindow& window, std::uint64_t offset,
                                    LogNames names = LogNames::kAscii) const;
  // The same where an event is expected.
  std::optional<LogHeader> ExpectedAt(std::uint64_t offset) {
    return HeaderAt(walk_, offset, LogNames::kUtf8);
  }
  // The first credible header in [from, to).
  std::optional<LogHeader> NextHeader(std::uint64_t from, std::uint64_t to);
  std::optional<LogHeader> NextSound(std::uint64_t from, std::uint64_t to);
  // What lies ahead of a place in a damaged stretch.
  struct Ahead {
    std::uint64_t from = 0;          // the place
    std::uint64_t credible = 0;      // first credible header, or the end of the file
    std::optional<LogHeader> sound;  // first sound event
  };
  // Remembered, so that many calls cost one pass.
  const Ahead& LookAhead(std::uint64_t from);
  bool IsSound(const LogHeader& event);
  // For an event where one is expected, which need not be sound.
  bool IsCredibleHere(const LogHeader& event);
  bool IsTooLong(const LogHeader& event);
  bool IsTooShort(const LogHeader& event);
  bool MayLookFurther(std::uint64_t looked_bytes);
  // Where the row of events that begins with `first` ends; events beyond `to` are not looked at.
  std::uint64_t EndOfRow(const LogHeader& first, std::uint64_t to);
  // Where the next event begins after damage at `from`; the end of the file if there is none.
  std::uint64_t Resume(std::uint64_t from);
  bool FitsBetweenNeighbours(const LogHeader& event, const std::optional<LogHeader>& next) const;

  void Accept(const LogHeader& event);
  std::string Describe(std::uint64_t from, std::uint64_t to);
  bool IsZero(std::uint64_t from, std::uint64_t to);

  std::uint64_t file_bytes_;
  FileWindow walk_, scan_, probe_;
  std::uint64_t looked_bytes_ = 0;  // for doubts about lengths
  std::optional<Ahead> ahead_;
  std::unordered_map<std::string, std::uint32_t> channel_index_;
  LogIndex index_;
};

}  // namespace forgescan
