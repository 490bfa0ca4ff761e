// Drives a RecordingMachine and keeps book of what it orders.
#pragma once

#include <gtest/gtest.h>

#include <map>

#include "fsmsg/verdict_t.hpp"
#include "services/recorder/recording_machine.h"

namespace forgescan::testing {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kFarUs = 9'000'000'000'000'000'000;  // everything has come
using Kind = RecordedMessage::Kind;

class MachineRig : public ::testing::Test {
 protected:
  struct File {
    std::optional<std::int32_t> part;
    std::int32_t volume = 0;
    int messages = 0;
    std::optional<CloseRecording> closed;
  };

  MachineRig() {
    Take(machine_.Start(now_us_));
    machine_.OnOpened(1);
  }
  void Take(const RecordingMachine::Actions& actions) {
    last_files_.clear();
    for (const RecordingAction& action : actions) {
      if (const auto* open = std::get_if<OpenRecording>(&action)) {
        EXPECT_TRUE(files_.emplace(open->file, File{open->part, open->volume, 0, {}}).second);
      } else if (const auto* append = std::get_if<AppendMessage>(&action)) {
        ASSERT_TRUE(files_.contains(append->file));
        EXPECT_FALSE(files_[append->file].closed.has_value()) << "written after it was closed";
        ++files_[append->file].messages;
        last_files_.push_back(append->file);
      } else if (const auto* close = std::get_if<CloseRecording>(&action)) {
        ASSERT_TRUE(files_.contains(close->file));
        EXPECT_FALSE(files_[close->file].closed.has_value()) << "closed twice";
        files_[close->file].closed = *close;
      } else {
        notes_.push_back(std::get<RecordingNote>(action));
      }
    }
  }
  // Returns the files it went to.
  std::vector<FileId> Say(Kind kind, std::optional<std::int32_t> part, std::int64_t utime = 0) {
    RecordedMessage message;
    message.kind = kind;
    message.part = part;
    message.now_us = now_us_;
    message.utime = utime == 0 ? now_us_ : utime;
    message.verdict = fsmsg::verdict_t::VERDICT_OK;
    message.bytes = 100;
    Take(machine_.OnMessage(message));
    return last_files_;
  }
  void Wait(double seconds, std::int64_t settled_us = kFarUs) {
    now_us_ += static_cast<std::int64_t>(seconds * kSecondUs);
    Take(machine_.OnTick(now_us_, settled_us));
  }
  FileId WholePart(int part) {
    const FileId file = Say(Kind::kArrived, part).at(0);
    Say(Kind::kStream, part);
    Say(Kind::kJudged, part);
    Say(Kind::kSorted, part);
    return file;
  }
  const CloseRecording& Closed(FileId file) {
    EXPECT_TRUE(files_[file].closed.has_value()) << file;
    static const CloseRecording none;
    return files_[file].closed.has_value() ? *files_[file].closed : none;
  }
  bool IsOpen(FileId file) { return !files_[file].closed.has_value(); }

  std::int64_t now_us_ = 20'000 * 86'400 * kSecondUs + 3600 * kSecondUs;
  RecorderConfig config_;
  RecordingMachine machine_{config_};
  std::map<FileId, File> files_;
  std::vector<RecordingNote> notes_;
  std::vector<FileId> last_files_;
};

}  // namespace forgescan::testing
