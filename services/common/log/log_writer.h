// Writes an LCM event log through LCM's own lcm/eventlog.h, but checks every write: LCM ignores errors of its
// buffered writes and would leave a hole in silence. The file has another name until it is closed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "services/common/bus/bus.h"
#include "services/common/result.h"

struct _lcm_eventlog_t;

namespace forgescan {

class LogWriter {
 public:
  // The file is `path` with `ending` until it is closed. Errors: kIo (either exists, or the latter cannot be
  // made). Nothing is ever overwritten or appended to.
  static Result<LogWriter> Create(const std::string& path, const std::string& ending = ".part");
  LogWriter(LogWriter&& other) noexcept;
  LogWriter& operator=(LogWriter&& other) noexcept;
  // Leaves the file open_path() as it is: a recording that nobody closed.
  ~LogWriter();

  const std::string& path() const { return path_; }
  const std::string& open_path() const { return open_path_; }
  std::int64_t events() const { return events_; }
  std::int64_t file_bytes() const { return file_bytes_; }

  // utime: us since 1970 UTC. Errors: kInvalidArgument (channel name empty or over 63 bytes), kIo (with the
  // system's reason; the file then ends with a whole event, and nothing more can be written).
  Status Write(std::string_view channel, std::int64_t utime, ByteView message);
  // What was written is on the disk when this returns. Errors: kIo.
  Status Sync();
  // Sync(), then the file becomes path(). Errors: kIo (also when that exists meanwhile: nothing is replaced).
  Status Close() { return CloseAs(std::string(path_)); }
  // The same under another name in the same folder, known only now; path() is that name afterwards.
  Status CloseAs(const std::string& path);

 private:
  LogWriter(std::string path, std::string open_path, _lcm_eventlog_t* log);
  Status Broken(const char* what);

  std::string path_, open_path_;
  _lcm_eventlog_t* log_ = nullptr;  // null = closed or broken
  std::int64_t events_ = 0;
  std::int64_t file_bytes_ = 0;
};

}  // namespace forgescan
