// Writes recordings on a thread of its own, behind a bounded backlog, so that a slow disk does not keep the
// bus waiting. What goes wrong is told in reports; after a failed write nothing more goes into that file.
//
// Threads: everything is called on one thread, that of the bus.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "fsmsg/recording_closed_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "services/common/log/channel_totals.h"
#include "services/common/log/log_writer.h"
#include "services/recorder/recording_machine.h"
#include "services/recorder/recording_store.h"
#include "services/recorder/station_files.h"

namespace forgescan {

struct FileOpened {
  FileId file = 0;
};
struct FileFailed {
  FileId file = 0;
  std::string reason;
};
struct FileClosed {
  FileId file = 0;
  bool part = false;  // not the station's
  std::size_t gaps = 0;
};
// Without consequence for a recording: what was deleted, or could not be, or a station's file that is gone.
struct WriterNote {
  enum class What { kDeleted, kError };
  What what = What::kError;
  std::string text;
};
using WriterReport = std::variant<FileOpened, FileFailed, FileClosed, WriterNote>;

class RecordingWriter {
 public:
  explicit RecordingWriter(std::int64_t backlog_limit_bytes);
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;
  // Writes everything first.
  ~RecordingWriter();

  // PATH.part is made; `opened` is its first event, the station's files follow. file_count is filled in here.
  // A file that cannot take them is removed again.
  void Open(FileId file, std::string path, fsmsg::recording_opened_t opened, std::vector<StationFile> files);
  // False: the backlog is full, and the message is not taken.
  bool Write(FileId file, const char* channel, std::int64_t utime, std::shared_ptr<const Bytes> message);
  // Brings what was written so far to the disk.
  void Sync(FileId file);
  // `closed` is its last event; its totals and the gaps known here alone are filled in. The file then becomes
  // what NameOf says of it.
  void Close(FileId file, RecordingName name, fsmsg::recording_closed_t closed);
  // Deletes what the rules let go; `now_us` is the age's end.
  void Prune(const RecordingStore& store, const RetentionRules& rules, std::int64_t now_us);

  // Received and not yet written.
  std::int64_t backlog_bytes() const;
  std::vector<WriterReport> TakeReports();
  // Returns when everything given so far is written.
  void Drain();

 private:
  struct OpenFile {
    LogWriter log;
    ChannelTotals totals;
    std::int64_t last_utime = 0;
    std::vector<fsmsg::recording_gap_t> gaps;  // known to the writer alone
  };
  using Job = std::function<void()>;

  void Queue(Job job, std::int64_t bytes);
  void Run();
  void Report(WriterReport report);
  // On the writer's thread.
  Status Begin(FileId file, const std::string& path, fsmsg::recording_opened_t& opened,
               const std::vector<StationFile>& files);
  Status Append(OpenFile& file, const char* channel, std::int64_t utime, ByteView message);
  Status Finish(OpenFile& file, RecordingName name, fsmsg::recording_closed_t& closed);
  // Does something with a file that is open, and gives it up when that fails.
  template <typename Action>
  void With(FileId file, const Action& action);

  std::int64_t backlog_limit_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<Job, std::int64_t>> jobs_;  // with the bytes they hold
  std::int64_t backlog_bytes_ = 0;
  bool busy_ = false;
  bool stopping_ = false;
  std::vector<WriterReport> reports_;
  std::map<FileId, OpenFile> files_;  // of the writer's thread alone
  bool doubts_age_ = false;           // of the writer's thread alone; as PruneOutcome says
  std::thread thread_;                // last: everything it uses is there before it
};

}  // namespace forgescan
