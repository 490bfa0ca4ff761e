// A small recording written by a test, as the recorder would write it.
#pragma once

#include <gtest/gtest.h>
#include <libdeflate.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_header.h"
#include "services/common/log/channel_totals.h"
#include "services/common/log/log_writer.h"

namespace forgescan::testing {

inline constexpr std::int64_t kSession = 1'700'000'000'000'000;

// A folder that goes with the test.
class TestFolder {
 public:
  TestFolder() : path_(std::filesystem::path(::testing::TempDir()) / UniqueName()) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  static std::string UniqueName() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    return "forgescan_" + std::to_string(getpid()) + "_" + (test != nullptr ? test->name() : "suite");
  }
  std::filesystem::path path_;
};

class WrittenRecording {
 public:
  explicit WrittenRecording(const std::string& path, const std::string& station = "test")
      : writer_(LogWriter::Create(path)), station_(station) {
    EXPECT_TRUE(writer_.ok()) << writer_.error().message;
  }
  ~WrittenRecording() { WriteAll(); }  // unless it was closed: one that lacks its end

  void File(const std::string& name, const std::string& text) {
    fsmsg::recorded_file_t file{};
    file.utime = kSession;
    file.name = name;
    file.data.assign(text.begin(), text.end());
    file.size = static_cast<std::int32_t>(file.data.size());
    file.crc32 = static_cast<std::int32_t>(libdeflate_crc32(0, text.data(), text.size()));
    Write(kRecordedFile.name, Encode(file), kSession);
    ++files_;
  }

  // Returns the message as it was written.
  template <typename Message>
  Bytes Stream(const Channel<Message>& channel, const Message& message, std::int64_t sequence) {
    Bytes bytes = Encode(message);
    EXPECT_TRUE(StampStreamHeader(bytes, {kSession, sequence}).ok());
    Write(channel.name, bytes, message.utime);
    return bytes;
  }

  template <typename Message>
  void State(const StateChannel<Message>& channel, const Message& message) {
    Write(channel.name, Encode(message), message.utime);
  }

  void Write(const char* channel, const Bytes& message, std::int64_t utime) {
    events_.push_back({channel, message, utime});
  }

  void Close(std::vector<fsmsg::recording_gap_t> gaps = {}) {
    CloseAfter([](auto&) {}, std::move(gaps));
  }
  // Spoils what was written, opening and closing event included, after the closing event has counted it.
  struct Event {
    std::string channel;
    Bytes message;
    std::int64_t utime;
  };
  void CloseAfter(const std::function<void(std::vector<Event>&)>& spoil,
                  std::vector<fsmsg::recording_gap_t> gaps = {}) {
    Open();
    fsmsg::recording_closed_t closed{};
    closed.utime = kSession;
    closed.gaps = std::move(gaps);
    closed.gap_count = static_cast<std::int32_t>(closed.gaps.size());
    ChannelTotals totals;
    for (const Event& event : events_) {
      totals.Add(event.channel, event.message);
    }
    closed.channels = totals.Totals();
    closed.channel_count = static_cast<std::int32_t>(closed.channels.size());
    events_.push_back({kRecordingClosed.name, Encode(closed), kSession});
    spoil(events_);
    WriteAll();
    const Status done = writer_->Close();
    EXPECT_TRUE(done.ok()) << done.error().message;
  }

 private:
  // The first event, which says how many files follow.
  void Open() {
    if (!std::exchange(opened_, true)) {
      fsmsg::recording_opened_t opened{};
      opened.utime = kSession;
      opened.station = station_;
      opened.file_count = files_;
      events_.insert(events_.begin(), {kRecordingOpened.name, Encode(opened), kSession});
    }
  }
  void WriteAll() {
    Open();
    for (const Event& event : std::exchange(events_, {})) {
      const Status written = writer_->Write(event.channel, event.utime, event.message);
      EXPECT_TRUE(written.ok()) << written.error().message;
    }
  }

  Result<LogWriter> writer_;
  std::string station_;
  std::vector<Event> events_;
  std::int32_t files_ = 0;
  bool opened_ = false;
};

}  // namespace forgescan::testing
