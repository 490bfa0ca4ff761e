// The thread that writes: what it does with files that cannot be made, written or closed, and with a backlog
// that is full.
#include "services/recorder/recording_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/services/recorder/recordings.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kUtime = 1'800'000'000'000'000;
constexpr std::int64_t kBacklog = 1'000'000;

class RecordingWriterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    base_ = fs::path(::testing::TempDir()) / ("forgescan_recording_writer_" + std::to_string(getpid()));
    fs::remove_all(base_);
    auto store = RecordingStore::Open(base_.string());
    ASSERT_TRUE(store.ok());
    store_.emplace(*std::move(store));
  }
  void TearDown() override { fs::remove_all(base_); }

  static RecordingName Name(int part) { return {kUtime, part, 1, false, false}; }
  static std::shared_ptr<const Bytes> Message(std::size_t bytes) {
    return std::make_shared<const Bytes>(bytes, std::uint8_t{7});
  }
  void Open(FileId file, int part, std::vector<StationFile> files = {}) {
    fsmsg::recording_opened_t opened{};
    opened.utime = kUtime;
    opened.part = part;
    writer_.Open(file, store_->PathOf(Name(part)), opened, std::move(files));
  }
  void Close(FileId file, int part, std::vector<fsmsg::recording_gap_t> gaps = {}) {
    fsmsg::recording_closed_t closed{};
    closed.utime = kUtime;
    closed.part = part;
    closed.gaps = std::move(gaps);
    writer_.Close(file, Name(part), closed);
  }
  // Last changed at `utime`.
  static void MakeFile(const fs::path& path, std::int64_t utime) {
    const std::chrono::sys_time<std::chrono::microseconds> time{std::chrono::microseconds(utime)};
    std::ofstream(path) << "old";
    fs::last_write_time(path, std::chrono::file_clock::from_sys(time));
  }
  template <typename Report>
  std::vector<Report> Reports() {
    writer_.Drain();
    std::vector<Report> found;
    for (const WriterReport& report : writer_.TakeReports()) {
      if (const auto* one = std::get_if<Report>(&report)) {
        found.push_back(*one);
      }
    }
    return found;
  }

  fs::path base_;
  std::optional<RecordingStore> store_;
  RecordingWriter writer_{kBacklog};
};

TEST_F(RecordingWriterTest, Starts) {
  EXPECT_EQ(writer_.backlog_bytes(), 0);
  EXPECT_THAT(writer_.TakeReports(), IsEmpty());
}

TEST_F(RecordingWriterTest, WritesInOrderAndTellsWhenAFileIsOpenAndClosed) {
  Open(1, 7);
  EXPECT_EQ(Reports<FileOpened>().size(), 1u);
  EXPECT_TRUE(writer_.Write(1, "A", kUtime + 5, Message(10)));
  EXPECT_TRUE(writer_.Write(1, "B", kUtime + 3, Message(20))) << "its time is then that of the one before";
  Close(1, 7);
  const auto closed = Reports<FileClosed>();
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_TRUE(closed[0].part);
  EXPECT_EQ(closed[0].gaps, 0u);
  const auto recordings = ReadRecordings(base_);
  ASSERT_EQ(recordings.size(), 1u);
  ASSERT_EQ(recordings[0].events.size(), 4u);
  EXPECT_EQ(recordings[0].events[1].channel, "A");
  EXPECT_EQ(recordings[0].events[2].utime, kUtime + 5);
  EXPECT_TRUE(recordings[0].name.complete);
}

TEST_F(RecordingWriterTest, WhatDoesNotFitIntoTheBacklogIsNotTaken) {
  Open(1, 7);
  EXPECT_FALSE(writer_.Write(1, "A", kUtime, Message(kBacklog + 1)));
  EXPECT_TRUE(writer_.Write(1, "A", kUtime, Message(kBacklog / 2)));
  writer_.Drain();
  EXPECT_EQ(writer_.backlog_bytes(), 0);
  EXPECT_TRUE(writer_.Write(1, "A", kUtime, Message(kBacklog))) << "there is room again";
  writer_.Drain();
}

TEST_F(RecordingWriterTest, AFileThatCannotBeMadeIsToldAndOthersAreWritten) {
  std::ofstream(store_->PathOf(Name(7)) + ".part") << "left behind";
  Open(1, 7);
  Open(2, 8);
  writer_.Write(1, "A", kUtime, Message(10));
  Close(1, 7);
  Close(2, 8);
  writer_.Drain();
  const auto reports = writer_.TakeReports();
  ASSERT_EQ(reports.size(), 3u);
  ASSERT_TRUE(std::holds_alternative<FileFailed>(reports[0]));
  EXPECT_EQ(std::get<FileFailed>(reports[0]).file, 1);
  EXPECT_THAT(std::get<FileFailed>(reports[0]).reason, HasSubstr("File exists"));
  EXPECT_EQ(std::get<FileClosed>(reports[2]).file, 2);
}

TEST_F(RecordingWriterTest, AFileThatCannotBeClosedIsTold) {
  Open(1, 7);
  writer_.Drain();
  fs::remove_all(base_ / "parts");
  Close(1, 7);
  ASSERT_EQ(Reports<FileFailed>().size(), 1u);
}

TEST_F(RecordingWriterTest, AStationsFileThatIsGoneIsAGap) {
  Open(1, 7, {{"views.toml", (base_ / "none").string()}});
  Close(1, 7);
  writer_.Drain();
  const auto recordings = ReadRecordings(base_);
  ASSERT_EQ(recordings.size(), 1u);
  EXPECT_EQ(recordings[0].opened.file_count, 0);
  ASSERT_EQ(recordings[0].closed->gaps.size(), 1u);
  EXPECT_EQ(recordings[0].closed->gaps[0].channel, "RECORDED_FILE");
  EXPECT_FALSE(recordings[0].name.complete);
}

TEST_F(RecordingWriterTest, DeletesWhatTheRulesLetGoButNoOpenFileAndNothingElse) {
  constexpr std::int64_t kDayUs = 86'400'000'000;
  const std::int64_t now_us = kUtime + 40 * kDayUs;
  Open(1, 7);
  MakeFile(base_ / "parts" / NameOf({kUtime, 8, 2, true, true}), kUtime);
  MakeFile(base_ / "station" / NameOf({kUtime + kDayUs * 20, std::nullopt, 0, true, true}), kUtime);
  std::ofstream(base_ / "parts/notes.txt") << "somebody's";
  writer_.Prune(*store_, RetentionRules{}, now_us);
  const auto notes = Reports<WriterNote>();
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0].what, WriterNote::What::kDeleted);
  EXPECT_THAT(notes[0].text, HasSubstr("part000008"));
  EXPECT_TRUE(fs::exists(base_ / "parts/notes.txt"));
  EXPECT_TRUE(fs::exists(store_->PathOf(Name(7)) + ".part"));
}

TEST_F(RecordingWriterTest, AClockInDoubtIsSaidOnce) {
  constexpr std::int64_t kDayUs = 86'400'000'000;
  MakeFile(base_ / "parts" / NameOf({kUtime, 8, 2, true, true}), kUtime);
  writer_.Prune(*store_, RetentionRules{}, kUtime + 400 * kDayUs);
  writer_.Prune(*store_, RetentionRules{}, kUtime + 400 * kDayUs);
  const auto notes = Reports<WriterNote>();
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_THAT(notes[0].text, HasSubstr("or the clock is wrong"));
}

TEST_F(RecordingWriterTest, ASecondRecorderOnTheFolderIsRefused) {
  const auto second = RecordingStore::Open(base_.string());
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message, HasSubstr("another recorder"));
  store_.reset();
  EXPECT_TRUE(RecordingStore::Open(base_.string()).ok());
}

TEST_F(RecordingWriterTest, FreeSpaceIsThatOfTheDiskWithTheFiles) {
  const auto free_bytes = [](const char* path) {
    return static_cast<std::int64_t>(fs::space(path).available);
  };
  if (!fs::exists("/dev/shm") || free_bytes("/dev/shm") >= free_bytes(base_.c_str())) {
    GTEST_SKIP() << "needs a second, smaller disk";
  }
  fs::remove(base_ / "parts");
  fs::create_directory_symlink("/dev/shm", base_ / "parts");
  const std::int64_t tolerance_bytes = 200'000'000;  // others write meanwhile
  EXPECT_LE(*store_->FreeBytes(),
            std::min(free_bytes("/dev/shm"), free_bytes(base_.c_str())) + tolerance_bytes);
}

TEST_F(RecordingWriterTest, AFolderThatIsGoneIsTold) {
  fs::remove_all(base_);
  writer_.Prune(*store_, RetentionRules{}, kUtime);
  const auto notes = Reports<WriterNote>();
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0].what, WriterNote::What::kError);
  EXPECT_FALSE(store_->FreeBytes().ok());
}

}  // namespace
}  // namespace forgescan::testing
