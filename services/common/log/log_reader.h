// Reads an LCM event log, whole or damaged. LCM's own reader stops at the first bad byte, trusts lengths up
// to 2 GB and takes a truncated log for a whole one; this one finds every event that is still there, and says
// what lies between.
//
// Format (LCM 1.3.1): per event a header of 28 bytes, big-endian: sync word EDA1DA01, int64 event number,
// int64 utime, int32 length of the channel's name, int32 length of the message; then name and message.
//
// Cost: opening reads the headers only (a seek an event); messages are read one at a time, so memory is the
// index and one message.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/common/bus/bus.h"
#include "services/common/log/log_format.h"
#include "services/common/result.h"

namespace forgescan {

// An event in the file.
struct LogEntry {
  std::uint64_t offset = 0;   // of its header
  std::int64_t number = 0;    // as written
  std::int64_t utime = 0;     // us since 1970 UTC of recording; not always in order
  std::uint32_t channel = 0;  // index in LogReader::channels()
  std::uint32_t bytes = 0;    // of the message
};

// A stretch of the file that is no event.
struct LogDamage {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::string what;  // one clause: "zeros", "bytes without a header", "an event that is cut off", ...
};

class LogReader {
 public:
  // Errors: kNotFound, kIo (cannot be read), kFormat (not one event in it). Damage is no error: see damage().
  static Result<LogReader> Open(const std::string& path);
  LogReader(LogReader&&) noexcept;
  LogReader& operator=(LogReader&&) noexcept;
  ~LogReader();

  const std::string& path() const { return path_; }
  std::uint64_t file_bytes() const { return file_bytes_; }
  const std::vector<LogEntry>& entries() const { return entries_; }  // in file order
  const std::vector<LogDamage>& damage() const { return damage_; }   // in file order; empty = whole
  const std::vector<std::string>& channels() const { return channels_; }
  const std::string& ChannelOf(const LogEntry& entry) const { return channels_[entry.channel]; }
  // Of the event in the file.
  std::uint64_t EndOf(const LogEntry& entry) const {
    return entry.offset + kLogHeaderBytes + ChannelOf(entry).size() + entry.bytes;
  }
  // The message, or at most its first bytes. Errors: kIo (the file has changed or cannot be read).
  Result<Bytes> Read(const LogEntry& entry, std::size_t at_most = kMaxLogMessageBytes) const;

 private:
  LogReader(std::string path, int fd, std::uint64_t file_bytes);

  std::string path_;
  int fd_ = -1;
  std::uint64_t file_bytes_ = 0;
  std::vector<LogEntry> entries_;
  std::vector<LogDamage> damage_;
  std::vector<std::string> channels_;
};

}  // namespace forgescan
