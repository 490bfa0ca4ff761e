#include "tools/forgescan/output_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace forgescan {
namespace {

namespace fs = std::filesystem;

class OutputFilesTest : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  void Write(const fs::path& path) const { std::ofstream(path) << "text"; }
  long FileCount() const { return std::distance(fs::directory_iterator(folder_), fs::directory_iterator()); }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("output_files_" + std::to_string(getpid()));
  const fs::path a_ = folder_ / "a";
  const fs::path b_ = folder_ / "b";
};

TEST_F(OutputFilesTest, StartsAndGivesAllFilesTheirNames) {
  auto files = OutputFiles::Create({}, {a_, "", b_});
  ASSERT_TRUE(files.ok()) << files.error().message;
  Write(files->Staged(a_));
  Write(files->Staged(b_));
  EXPECT_FALSE(fs::exists(a_));
  ASSERT_TRUE(files->Commit().ok());
  EXPECT_TRUE(fs::exists(a_) && fs::exists(b_));
  EXPECT_EQ(FileCount(), 2);
}

TEST_F(OutputFilesTest, LeavesNothingWithoutCommit) {
  Write(a_);
  {
    const auto files = OutputFiles::Create({}, {a_, b_});
    ASSERT_TRUE(files.ok()) << files.error().message;
    EXPECT_FALSE(fs::exists(a_));
    Write(files->Staged(b_));
  }
  EXPECT_EQ(FileCount(), 0);
}

TEST_F(OutputFilesTest, AFailedCommitTakesBackTheOthers) {
  auto files = OutputFiles::Create({}, {a_, b_});
  ASSERT_TRUE(files.ok()) << files.error().message;
  Write(files->Staged(a_));  // b is never written
  const Status status = files->Commit();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_EQ(FileCount(), 0);
}

TEST_F(OutputFilesTest, RefusesBeforeItRemovesAnything) {
  Write(a_);
  Write(b_);
  fs::create_hard_link(b_, folder_ / "hard");
  EXPECT_FALSE(OutputFiles::Create({b_}, {a_, b_}).ok());
  EXPECT_FALSE(OutputFiles::Create({b_}, {a_, folder_ / "." / "b"}).ok());
  EXPECT_FALSE(OutputFiles::Create({b_}, {a_, folder_ / "hard"}).ok());
  EXPECT_FALSE(OutputFiles::Create({folder_}, {a_}).ok());
  EXPECT_FALSE(OutputFiles::Create({}, {a_, a_}).ok());
  EXPECT_FALSE(OutputFiles::Create({}, {a_, folder_}).ok());
  EXPECT_FALSE(OutputFiles::Create({}, {a_, folder_ / "none" / "c"}).ok());
  EXPECT_EQ(FileCount(), 3);
}

TEST_F(OutputFilesTest, WritesDevicesDirectly) {
  auto files = OutputFiles::Create({}, {"/dev/null"});
  ASSERT_TRUE(files.ok()) << files.error().message;
  EXPECT_EQ(files->Staged("/dev/null"), "/dev/null");
  EXPECT_TRUE(files->Commit().ok());
  EXPECT_TRUE(fs::exists("/dev/null"));
}

}  // namespace
}  // namespace forgescan
