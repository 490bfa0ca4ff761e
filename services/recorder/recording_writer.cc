#include "services/recorder/recording_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/recorder/gaps.h"

namespace forgescan {

RecordingWriter::RecordingWriter(std::int64_t backlog_limit_bytes)
    : backlog_limit_bytes_(backlog_limit_bytes), thread_([this] { Run(); }) {}

RecordingWriter::~RecordingWriter() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void RecordingWriter::Queue(Job job, std::int64_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.emplace_back(std::move(job), bytes);
    backlog_bytes_ += bytes;
  }
  changed_.notify_all();
}

void RecordingWriter::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
    if (jobs_.empty()) {
      return;
    }
    auto [job, bytes] = std::move(jobs_.front());
    jobs_.pop_front();
    busy_ = true;
    lock.unlock();
    job();
    job = nullptr;  // the message it held goes before it is no longer counted
    lock.lock();
    busy_ = false;
    backlog_bytes_ -= bytes;
    changed_.notify_all();
  }
}

void RecordingWriter::Report(WriterReport report) {
  const std::lock_guard lock(mutex_);
  reports_.push_back(std::move(report));
}

std::vector<WriterReport> RecordingWriter::TakeReports() {
  const std::lock_guard lock(mutex_);
  return std::exchange(reports_, {});
}

std::int64_t RecordingWriter::backlog_bytes() const {
  const std::lock_guard lock(mutex_);
  return backlog_bytes_;
}

void RecordingWriter::Drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return jobs_.empty() && !busy_; });
}

template <typename Action>
void RecordingWriter::With(FileId file, const Action& action) {
  const auto found = files_.find(file);
  if (found == files_.end()) {
    return;  // given up before
  }
  if (const Status status = action(found->second); !status.ok()) {
    files_.erase(found);
    Report(FileFailed{file, status.error().message});
  }
}

void RecordingWriter::Open(FileId file, std::string path, fsmsg::recording_opened_t opened,
                           std::vector<StationFile> files) {
  Queue(
      [this, file, path = std::move(path), opened = std::move(opened), files = std::move(files)]() mutable {
        if (const Status status = Begin(file, path, opened, files); !status.ok()) {
          if (files_.erase(file) > 0) {  // it was made, and holds nothing that was said on the bus
            std::error_code ignored;
            std::filesystem::remove(path + ".part", ignored);
          }
          Report(FileFailed{file, status.error().message});
        } else {
          Report(FileOpened{file});
        }
      },
      0);
}

Status RecordingWriter::Begin(FileId file, const std::string& path, fsmsg::recording_opened_t& opened,
                              const std::vector<StationFile>& files) {
  ASSIGN_OR_RETURN(LogWriter log, LogWriter::Create(path));
  OpenFile& open = files_.emplace(file, OpenFile{std::move(log), {}, 0, {}}).first->second;
  std::vector<fsmsg::recorded_file_t> read;
  for (const StationFile& wanted : files) {
    auto content = ReadStationFile(wanted);
    if (content.ok()) {
      read.push_back(std::move(*content));
      read.back().utime = opened.utime;
    } else {  // the measurement goes on, and so does its recording
      AddGap(open.gaps, GapOf(kRecordedFile.name, content.error().message));
      Report(WriterNote{WriterNote::What::kError, content.error().message});
    }
  }
  opened.file_count = static_cast<std::int32_t>(read.size());
  RETURN_IF_ERROR(Append(open, kRecordingOpened.name, opened.utime, Encode(opened)));
  for (const fsmsg::recorded_file_t& content : read) {
    RETURN_IF_ERROR(Append(open, kRecordedFile.name, opened.utime, Encode(content)));
  }
  return {};
}

Status RecordingWriter::Append(OpenFile& file, const char* channel, std::int64_t utime, ByteView message) {
  file.last_utime = std::max(file.last_utime, utime);
  RETURN_IF_ERROR(file.log.Write(channel, file.last_utime, message));
  file.totals.Add(channel, message);
  return {};
}

bool RecordingWriter::Write(FileId file, const char* channel, std::int64_t utime,
                            std::shared_ptr<const Bytes> message) {
  const auto bytes = static_cast<std::int64_t>(message->size());
  if (backlog_bytes() + bytes > backlog_limit_bytes_) {
    return false;
  }
  Queue(
      [this, file, channel, utime, message = std::move(message)] {
        With(file, [&](OpenFile& open) { return Append(open, channel, utime, *message); });
      },
      bytes);
  return true;
}

void RecordingWriter::Sync(FileId file) {
  Queue([this, file] { With(file, [](OpenFile& open) { return open.log.Sync(); }); }, 0);
}

void RecordingWriter::Close(FileId file, RecordingName name, fsmsg::recording_closed_t closed) {
  Queue(
      [this, file, name, closed = std::move(closed)]() mutable {
        With(file, [&](OpenFile& open) {
          Status status = Finish(open, name, closed);
          if (status.ok()) {
            Report(FileClosed{file, name.part.has_value(), closed.gaps.size()});
          }
          return status;
        });
        files_.erase(file);
      },
      0);
}

Status RecordingWriter::Finish(OpenFile& file, RecordingName name, fsmsg::recording_closed_t& closed) {
  closed.gaps.insert(closed.gaps.end(), file.gaps.begin(), file.gaps.end());
  closed.gap_count = static_cast<std::int32_t>(closed.gaps.size());
  closed.channels = file.totals.Totals();
  closed.channel_count = static_cast<std::int32_t>(closed.channels.size());
  RETURN_IF_ERROR(Append(file, kRecordingClosed.name, closed.utime, Encode(closed)));
  name.closed = true;
  name.complete = closed.gaps.empty();
  const auto folder = std::filesystem::path(file.log.path()).parent_path();
  return file.log.CloseAs((folder / NameOf(name)).string());
}

void RecordingWriter::Prune(const RecordingStore& store, const RetentionRules& rules, std::int64_t now_us) {
  Queue(
      [this, store, rules, now_us] {
        std::vector<std::string> open;
        for (const auto& [file, held] : files_) {
          open.push_back(held.log.open_path());
        }
        const PruneOutcome outcome = store.Prune(rules, open, now_us);
        for (const Deletion& deletion : outcome.deleted) {
          Report(WriterNote{WriterNote::What::kDeleted,
                            fmt::format("{} deleted: {}", deletion.path, deletion.reason)});
        }
        for (const std::string& error : outcome.errors) {
          Report(WriterNote{WriterNote::What::kError, error});
        }
        if (!outcome.doubt.empty() && !doubts_age_) {  // once, not after every part
          Report(WriterNote{WriterNote::What::kError, outcome.doubt});
        }
        doubts_age_ = !outcome.doubt.empty();
      },
      0);
}

}  // namespace forgescan
