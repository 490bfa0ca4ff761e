// The results database: what was put in is there after a restart; files that are not ours, or not to be
// written, are errors.
#include "services/report/history.h"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "services/report/report_files.h"
#include "tests/services/report/sample_report.h"

namespace forgescan {
namespace {

class HistoryTest : public ::testing::Test {
 protected:
  HistoryTest() { std::filesystem::remove_all(folder_), std::filesystem::create_directories(folder_); }
  ~HistoryTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / fmt::format("forgescan-history-{}", getpid());
  std::string path_ = (folder_ / "history.sqlite").string();
};

PartRecord Record(int part) {
  const PartReport report = SampleReport(12);
  PartRecord record{part,
                    1'700'000'000'000'000 + part,
                    report.verdict.verdict,
                    report.verdict.reason,
                    "folder",
                    report.dimensions};
  record.dimensions[0].measured_mm += part;
  return record;
}

TEST_F(HistoryTest, KeepsEverythingOverARestart) {
  {
    Result<History> history = History::Open(path_);
    ASSERT_TRUE(history.ok()) << history.error().message;
    for (int part = 1; part <= 3; ++part) {
      ASSERT_TRUE(history->Append(Record(part)).ok());
    }
  }
  Result<History> history = History::Open(path_);
  ASSERT_TRUE(history.ok());
  const auto points = history->LastValues("total length", 25);
  ASSERT_TRUE(points.ok());
  ASSERT_EQ(points->size(), 3u);
  EXPECT_EQ((*points)[0].part, 1);
  EXPECT_EQ((*points)[2].part_index, 3);
  EXPECT_EQ((*points)[2].measured_mm, Record(3).dimensions[0].measured_mm);
  EXPECT_EQ((*points)[2].verdict, Record(3).dimensions[0].verdict);
  const auto parts = history->LastParts(2);
  ASSERT_TRUE(parts.ok());
  ASSERT_EQ(parts->size(), 2u);
  EXPECT_EQ((*parts)[0].part, 3) << "newest first";
  EXPECT_EQ((*parts)[0].reason, Record(3).reason);
}

TEST_F(HistoryTest, ANotMeasuredValueComesBackAsNan) {
  Result<History> history = History::Open(path_);
  ASSERT_TRUE(history.ok());
  ASSERT_TRUE(history->Append(Record(1)).ok());
  const auto points = history->LastValues("left cylinder diameter", 25);
  ASSERT_TRUE(points.ok());
  EXPECT_TRUE(std::isnan(points->at(0).measured_mm));
  EXPECT_EQ(points->at(0).verdict, Verdict::kNotInspected);
}

TEST_F(HistoryTest, GivesTheLastTwentyFive) {
  Result<History> history = History::Open(path_);
  ASSERT_TRUE(history.ok());
  for (int part = 1; part <= 30; ++part) {
    ASSERT_TRUE(history->Append(Record(part)).ok());
  }
  const auto points = history->LastValues("total length", 25);
  ASSERT_TRUE(points.ok());
  EXPECT_EQ(points->size(), 25u);
  EXPECT_EQ(points->front().part, 6);
  EXPECT_EQ(points->back().part, 30);
  EXPECT_TRUE(history->LastValues("'; DROP TABLE part; --", 25)->empty());
}

TEST_F(HistoryTest, APartIsInOnceAndWhole) {
  Result<History> history = History::Open(path_);
  ASSERT_TRUE(history.ok());
  ASSERT_TRUE(history->Append(Record(1)).ok());
  const Status again = history->Append(Record(1));
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::kInvalidArgument);
  PartRecord twice = Record(2);
  twice.dimensions.push_back(twice.dimensions[0]);  // the same name twice
  EXPECT_FALSE(history->Append(twice).ok());
  EXPECT_EQ(history->LastParts(10)->size(), 1u);
  EXPECT_TRUE(history->Append(Record(2)).ok()) << "still works after the errors";
}

TEST_F(HistoryTest, AFileThatIsNoDatabaseIsAClearError) {
  std::ofstream(path_) << "this is a text, longer than the header of a database: " << std::string(4096, 'x');
  const Result<History> history = History::Open(path_);
  ASSERT_FALSE(history.ok());
  EXPECT_EQ(history.error().code, ErrorCode::kFormat);
  EXPECT_NE(history.error().message.find(path_), std::string::npos);
}

TEST_F(HistoryTest, ADatabaseCutShortIsAnError) {
  {
    Result<History> history = History::Open(path_);
    ASSERT_TRUE(history.ok());
    for (int part = 1; part <= 60; ++part) {
      ASSERT_TRUE(history->Append(Record(part)).ok());
    }
  }
  std::filesystem::resize_file(path_, 9000);
  Result<History> history = History::Open(path_);
  const bool told =
      !history.ok() || !history->LastValues("total length", 100).ok() || !history->Append(Record(99)).ok();
  EXPECT_TRUE(told);
}

TEST_F(HistoryTest, AnotherVersionOfTheTablesIsRefused) {
  ASSERT_TRUE(History::Open(path_).ok());
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(path_.c_str(), &handle), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(handle, "UPDATE schema_version SET version = 99", nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(handle);
  const Result<History> history = History::Open(path_);
  ASSERT_FALSE(history.ok());
  EXPECT_EQ(history.error().code, ErrorCode::kFormat);
  EXPECT_NE(history.error().message.find("version 99"), std::string::npos);
}

TEST_F(HistoryTest, AFolderThatCannotBeWrittenIsAnError) {
  // A folder below a file cannot be made or written by anybody, root included.
  std::ofstream(folder_ / "file") << "x";
  const Result<History> history = History::Open((folder_ / "file" / "history.sqlite").string());
  ASSERT_FALSE(history.ok());
  EXPECT_EQ(history.error().code, ErrorCode::kIo);
  EXPECT_FALSE(WriteWholeFile((folder_ / "file" / "report.json").string(), "{}").ok());
}

TEST_F(HistoryTest, AReadOnlyFolderIsAnError) {
  if (geteuid() == 0) {
    GTEST_SKIP() << "root may write everywhere";
  }
  std::filesystem::permissions(folder_,
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_FALSE(History::Open(path_).ok());
  std::filesystem::permissions(folder_, std::filesystem::perms::owner_all);
  EXPECT_TRUE(History::Open(path_).ok());
}

TEST_F(HistoryTest, WholeFilesReplaceAndLeaveNothingBehind) {
  const std::string path = (folder_ / "a" / "b" / "report.json").string();
  ASSERT_TRUE(WriteWholeFile(path, "first").ok());
  ASSERT_TRUE(WriteWholeFile(path, "second").ok());
  std::string text;
  std::getline(std::ifstream(path) >> std::ws, text);
  EXPECT_EQ(text, "second");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

}  // namespace
}  // namespace forgescan
