// What the writer leaves on the disk is read back with LCM's own reader: files must be LCM's format, and
// whole up to the last event that was reported as written, whatever goes wrong.
#include "services/common/log/log_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/common/log/read_log.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::LogEvent;
using testing::ReadLog;

// No file of this process may grow beyond a size: writes then fail as on a full disk, with another reason.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    signal_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*signal_)(int);
};

class LogWriterTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("forgescan_log_writer_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string Path(const std::string& name = "a.lcmlog") const { return (folder_ / name).string(); }

  fs::path folder_;
  const Bytes message_{1, 2, 3, 4, 5, 6, 7};
};

TEST_F(LogWriterTest, Starts) {
  const auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  EXPECT_TRUE(fs::exists(Path() + ".part"));
  EXPECT_FALSE(fs::exists(Path()));
  EXPECT_EQ(writer->events(), 0);
}

TEST_F(LogWriterTest, LcmReadsWhatWasWritten) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  const Bytes large(5'000'000, 42);
  ASSERT_TRUE(writer->Write("ONE", 10, message_).ok());
  ASSERT_TRUE(writer->Write("TWO", 20, large).ok());
  ASSERT_TRUE(writer->Write("EMPTY", 20, {}).ok());
  ASSERT_TRUE(writer->Close().ok());
  EXPECT_FALSE(fs::exists(Path() + ".part"));
  EXPECT_EQ(static_cast<std::uintmax_t>(writer->file_bytes()), fs::file_size(Path()));
  const std::vector<LogEvent> wanted{{0, 10, "ONE", message_}, {1, 20, "TWO", large}, {2, 20, "EMPTY", {}}};
  EXPECT_EQ(ReadLog(Path()), wanted);
}

TEST_F(LogWriterTest, EveryEventIsInTheFileWhenWriteReturns) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->Write("ONE", 10, message_).ok());
  EXPECT_EQ(fs::file_size(Path() + ".part"), static_cast<std::uintmax_t>(writer->file_bytes()));
  EXPECT_EQ(ReadLog(Path() + ".part").size(), 1u);
}

TEST_F(LogWriterTest, ClosesUnderANameThatIsKnownOnlyThen) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->Write("ONE", 10, message_).ok());
  ASSERT_TRUE(writer->CloseAs(Path("a_OK.lcmlog")).ok());
  EXPECT_EQ(writer->path(), Path("a_OK.lcmlog"));
  EXPECT_EQ(ReadLog(Path("a_OK.lcmlog")).size(), 1u);
  EXPECT_FALSE(fs::exists(Path()));
  EXPECT_FALSE(fs::exists(Path() + ".part"));
}

TEST_F(LogWriterTest, NothingIsOverwritten) {
  std::ofstream(Path()) << "precious";
  EXPECT_THAT(LogWriter::Create(Path()).error().message, HasSubstr("exists already"));
  std::ofstream(Path("b.lcmlog.part")) << "precious";
  EXPECT_THAT(LogWriter::Create(Path("b.lcmlog")).error().message, HasSubstr("b.lcmlog.part"));
  EXPECT_EQ(fs::file_size(Path("b.lcmlog.part")), 8u);
}

TEST_F(LogWriterTest, AFileThatAppearsMeanwhileIsNotReplaced) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->Write("ONE", 10, message_).ok());
  std::ofstream(Path()) << "precious";
  EXPECT_FALSE(writer->Close().ok());
  EXPECT_EQ(fs::file_size(Path()), 8u);
  EXPECT_EQ(ReadLog(Path() + ".part").size(), 1u);
}

TEST_F(LogWriterTest, AFolderThatIsNotThereIsAnError) {
  EXPECT_THAT(LogWriter::Create(Path("none/a.lcmlog")).error().message, HasSubstr("cannot be made"));
}

TEST_F(LogWriterTest, WrongEventsAreRefusedAndTheNextIsWritten) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  EXPECT_EQ(writer->Write("", 10, message_).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(writer->Write(std::string(64, 'X'), 10, message_).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(writer->Write("ONE", 10, Bytes(64'000'001)).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(writer->Write(std::string(63, 'X'), 10, message_).ok());
  EXPECT_EQ(ReadLog(Path() + ".part").size(), 1u);
}

TEST_F(LogWriterTest, AfterAFailedWriteTheFileEndsWithAWholeEvent) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->Write("ONE", 10, message_).ok());
  const std::int64_t whole_bytes = writer->file_bytes();
  {
    const FileSizeLimit limit(20'000);
    const Status refused = writer->Write("TWO", 20, Bytes(100'000, 7));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::kIo);
    EXPECT_THAT(refused.error().message, HasSubstr("File too large"));
  }
  EXPECT_FALSE(writer->Write("THREE", 30, message_).ok()) << "a hole would be silent";
  EXPECT_FALSE(writer->Sync().ok());
  EXPECT_FALSE(writer->Close().ok());
  EXPECT_EQ(fs::file_size(Path() + ".part"), static_cast<std::uintmax_t>(whole_bytes));
  EXPECT_EQ(ReadLog(Path() + ".part").size(), 1u);
  EXPECT_FALSE(fs::exists(Path()));
}

TEST_F(LogWriterTest, ASmallEventThatDoesNotFitIsNoticedAtOnce) {
  auto writer = LogWriter::Create(Path());
  ASSERT_TRUE(writer.ok());
  const FileSizeLimit limit(100);
  std::size_t written = 0;
  while (writer->Write("ONE", 10, message_).ok()) {
    ++written;
  }
  EXPECT_EQ(written, 100 / (28 + 3 + message_.size()));
  EXPECT_EQ(ReadLog(Path() + ".part").size(), written);
}

TEST_F(LogWriterTest, AnotherFileWorksAfterAFailedOne) {
  {
    auto broken = LogWriter::Create(Path());
    ASSERT_TRUE(broken.ok());
    const FileSizeLimit limit(10);
    EXPECT_FALSE(broken->Write("ONE", 10, message_).ok());
  }
  auto writer = LogWriter::Create(Path("b.lcmlog"));
  ASSERT_TRUE(writer.ok());
  EXPECT_TRUE(writer->Write("ONE", 10, message_).ok());
  EXPECT_TRUE(writer->Close().ok());
  EXPECT_FALSE(writer->Close().ok()) << "once";
  EXPECT_EQ(ReadLog(Path("b.lcmlog")).size(), 1u);
}

TEST_F(LogWriterTest, ARecordingThatNobodyClosedStaysAPart) {
  {
    auto writer = LogWriter::Create(Path());
    ASSERT_TRUE(writer.ok());
    ASSERT_TRUE(writer->Write("ONE", 10, message_).ok());
    LogWriter moved = std::move(*writer);
    ASSERT_TRUE(moved.Write("TWO", 20, message_).ok());
  }
  EXPECT_EQ(ReadLog(Path() + ".part").size(), 2u);
  EXPECT_FALSE(fs::exists(Path()));
}

}  // namespace
}  // namespace forgescan
