#include "services/common/log/log_scanner.h"

#include <algorithm>
#include <cstring>

namespace forgescan {
namespace {

constexpr std::size_t kWalkBytes = 64 << 10;  // small events come many at a time, large ones are skipped
constexpr std::size_t kScanBytes = 1 << 20;
constexpr std::size_t kProbeBytes = 512;  // a look at one place far away
constexpr std::uint64_t kMostMissingEvents = 1'000'000;
constexpr std::uint64_t kDoubtPerByte = 16, kDoubtBytes = 16 << 20;

// The numbers of the two say that `later` was written some events after `earlier`. They begin at 0 in each
// log; what only looks like a header has any number.
std::uint64_t Step(std::int64_t earlier, std::int64_t later) {
  return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
}
bool Succeeds(std::int64_t earlier, std::int64_t later) {
  return Step(earlier, later) >= 1 && Step(earlier, later) <= kMostMissingEvents;
}
bool IsNext(std::int64_t earlier, std::int64_t later) { return Step(earlier, later) == 1; }

}  // namespace

LogScanner::LogScanner(int fd, std::uint64_t file_bytes)
    : file_bytes_(file_bytes),
      walk_(fd, file_bytes, kWalkBytes),
      scan_(fd, file_bytes, kScanBytes),
      probe_(fd, file_bytes, kProbeBytes) {}

Result<LogIndex> LogScanner::Run() {
  for (std::uint64_t at = 0; at < file_bytes_;) {
    const std::optional<LogHeader> event = ExpectedAt(at);
    if (event && IsCredibleHere(*event)) {
      Accept(*event);
      at = event->end();
      continue;
    }
    const std::uint64_t next = Resume(at);
    index_.damage.push_back({at, next - at, Describe(at, next)});
    at = next;
  }
  for (const FileWindow* window : {&walk_, &scan_, &probe_}) {
    RETURN_IF_ERROR(window->status());
  }
  return std::move(index_);
}

std::optional<LogHeader> LogScanner::HeaderAt(FileWindow& window, std::uint64_t offset,
                                              LogNames names) const {
  const ByteView bytes = window.From(offset, kMaxLogHeadBytes);
  std::optional<LogHeader> header =
      HasLogSyncWord(bytes) ? ParseLogHeader(bytes, offset, names) : std::nullopt;
  return header && header->end() <= file_bytes_ ? header : std::nullopt;
}

std::optional<LogHeader> LogScanner::NextHeader(std::uint64_t from, std::uint64_t to) {
  constexpr auto kFirstByte = static_cast<std::uint8_t>(kLogSyncWord >> 24);
  while (from < to) {
    const ByteView bytes = scan_.From(from, kMaxLogHeadBytes);
    if (bytes.size() < kLogHeaderBytes) {
      return std::nullopt;
    }
    const void* found = std::memchr(bytes.data(), kFirstByte, bytes.size());
    const std::size_t skip =
        found == nullptr ? bytes.size()
                         : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - bytes.data());
    from += skip;
    if (found == nullptr || from >= to) {
      continue;
    }
    const bool is_whole = bytes.size() - skip >= kMaxLogHeadBytes;
    if (!is_whole || HasLogSyncWord(bytes.subspan(skip))) {
      if (auto header = HeaderAt(scan_, from)) {
        return header;
      }
    }
    ++from;
  }
  return std::nullopt;
}

bool LogScanner::IsSound(const LogHeader& event) {
  const auto next = HeaderAt(probe_, event.end());
  return event.end() == file_bytes_ ||
         (next && (next->number == event.number || Succeeds(event.number, next->number)));
}

std::optional<LogHeader> LogScanner::NextSound(std::uint64_t from, std::uint64_t to) {
  std::optional<LogHeader> header = NextHeader(from, to);
  while (header && !IsSound(*header)) {
    header = NextHeader(header->offset + 1, to);
  }
  return header;
}

const LogScanner::Ahead& LogScanner::LookAhead(std::uint64_t from) {
  const bool is_known = ahead_ && ahead_->from <= from && (!ahead_->sound || ahead_->sound->offset >= from);
  if (!is_known) {
    const auto credible = NextHeader(from, file_bytes_);
    Ahead ahead{from, credible ? credible->offset : file_bytes_, std::nullopt};
    ahead.sound = NextSound(ahead.credible, file_bytes_);
    ahead_ = std::move(ahead);
  }
  return *ahead_;
}

bool LogScanner::IsCredibleHere(const LogHeader& event) {
  const auto next = ExpectedAt(event.end());
  if (next && IsNext(event.number, next->number)) {
    return true;
  }
  const bool is_followed = next || event.end() == file_bytes_;
  if (!is_followed && !IsAscii(event.channel)) {
    return false;
  }
  return !IsTooLong(event) && (is_followed || !IsTooShort(event));
}

bool LogScanner::MayLookFurther(std::uint64_t looked_bytes) {
  looked_bytes_ += looked_bytes;
  return looked_bytes_ <= kDoubtPerByte * file_bytes_ + kDoubtBytes;
}

// An event within the claimed extent that was written after this one, by its number, says so. So does a row
// of events that runs across the end of the extent; a row that ends before it may as well be a log that the
// message contains.
bool LogScanner::IsTooLong(const LogHeader& event) {
  std::uint64_t from = event.offset + 1;
  std::optional<LogHeader> inner = NextHeader(from, event.end());
  while (MayLookFurther((inner ? inner->offset : event.end()) - from) && inner) {
    if (Succeeds(event.number, inner->number)) {
      return true;
    }
    std::uint64_t next = inner->offset + 1;
    if (IsSound(*inner)) {
      next = EndOfRow(*inner, event.end());
      if (next > event.end()) {
        return true;
      }
    }
    from = next;
    inner = NextHeader(from, event.end());
  }
  return false;
}

std::uint64_t LogScanner::EndOfRow(const LogHeader& first, std::uint64_t to) {
  std::uint64_t end = first.end();
  while (end < to && MayLookFurther(kProbeBytes)) {
    const auto next = HeaderAt(probe_, end);
    if (!next) {
      break;
    }
    end = next->end();
  }
  return end;
}

// If no event is missing between this one and the next, the bytes between them are the rest of this one.
bool LogScanner::IsTooShort(const LogHeader& event) {
  if (!MayLookFurther(0)) {
    return false;
  }
  const auto& sound = LookAhead(event.end()).sound;
  const std::uint64_t to = sound ? sound->offset + 1 : file_bytes_;
  std::uint64_t from = event.end();
  for (auto next = NextHeader(from, to); MayLookFurther((next ? next->offset : to) - from) && next;
       next = NextHeader(from, to)) {
    if (Succeeds(event.number, next->number)) {
      return IsNext(event.number, next->number);
    }
    from = next->offset + 1;
  }
  return false;
}

std::uint64_t LogScanner::Resume(std::uint64_t from) {
  const ByteView bytes = walk_.From(from, kMaxLogHeadBytes);
  const auto unsynced = HasLogSyncWord(bytes) ? std::nullopt : ParseLogHeader(bytes, from, LogNames::kAscii);
  if (unsynced && unsynced->end() <= file_bytes_ && IsSound(*unsynced)) {
    return unsynced->end();  // only the sync word is wrong
  }
  const auto& [place, credible, sound] = LookAhead(from + 1);
  const std::uint64_t to = sound ? sound->offset : file_bytes_;
  for (auto event = NextHeader(std::max(from + 1, credible), to); event;
       event = NextHeader(event->offset + 1, to)) {
    if (event->end() <= to && FitsBetweenNeighbours(*event, sound)) {
      return event->offset;  // undamaged between two damages
    }
  }
  return to;
}

bool LogScanner::FitsBetweenNeighbours(const LogHeader& event, const std::optional<LogHeader>& next) const {
  const bool has_last = !index_.entries.empty();
  return (has_last && Succeeds(index_.entries.back().number, event.number)) ||
         (next && Succeeds(event.number, next->number)) || (!has_last && !next);
}

void LogScanner::Accept(const LogHeader& event) {
  const auto [channel, is_new] =
      channel_index_.try_emplace(event.channel, static_cast<std::uint32_t>(index_.channels.size()));
  if (is_new) {
    index_.channels.push_back(event.channel);
  }
  index_.entries.push_back({event.offset, event.number, event.utime, channel->second, event.bytes});
}

std::string LogScanner::Describe(std::uint64_t from, std::uint64_t to) {
  if (IsZero(from, to)) {
    return "zeros";
  }
  const ByteView bytes = walk_.From(from, kMaxLogHeadBytes);
  const auto header = ParseLogHeader(bytes, from, LogNames::kAscii);
  if (!HasLogSyncWord(bytes)) {
    return header && header->end() == to ? "an event with a bad sync word" : "bytes without a header";
  }
  if (to == file_bytes_ && (header ? header->end() > to : bytes.size() < kMaxLogHeadBytes)) {
    return "an event that is cut off";
  }
  return header ? "an event whose length does not fit what follows"
                : "an event with an impossible length or channel name";
}

bool LogScanner::IsZero(std::uint64_t from, std::uint64_t to) {
  while (from < to) {
    const ByteView bytes = scan_.From(from, 1);
    const ByteView part = bytes.first(std::min<std::uint64_t>(bytes.size(), to - from));
    if (part.empty() || std::any_of(part.begin(), part.end(), [](std::uint8_t byte) { return byte != 0; })) {
      return false;
    }
    from += part.size();
  }
  return true;
}

}  // namespace forgescan
