#include "tests/services/recorder/recordings.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/log/channel_totals.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;

void CheckTotals(const Recording& recording) {
  ChannelTotals totals;
  for (std::size_t i = 0; i + 1 < recording.events.size(); ++i) {
    totals.Add(recording.events[i].channel, recording.events[i].message);
  }
  const auto counted = totals.Totals();
  ASSERT_EQ(recording.closed->channels.size(), counted.size()) << recording.path;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    const auto& said = recording.closed->channels[i];
    EXPECT_EQ(said.channel, counted[i].channel) << recording.path;
    EXPECT_EQ(said.events, counted[i].events) << recording.path;
    EXPECT_EQ(said.bytes, counted[i].bytes) << recording.path;
    EXPECT_EQ(said.crc32, counted[i].crc32) << recording.path;
  }
}

void CheckOrder(const Recording& recording) {
  for (std::size_t i = 0; i < recording.events.size(); ++i) {
    EXPECT_EQ(recording.events[i].number, static_cast<std::int64_t>(i)) << recording.path;
    if (i > 0) {
      EXPECT_GE(recording.events[i].utime, recording.events[i - 1].utime) << recording.path;
    }
  }
}

Recording Read(const fs::path& path) {
  Recording recording;
  recording.path = path.string();
  const auto name = ParseRecordingName(path.filename().string());
  EXPECT_TRUE(name.has_value()) << path;
  recording.name = name.value_or(RecordingName{});
  recording.events = ReadLog(recording.path);
  if (recording.events.empty()) {
    return recording;
  }
  EXPECT_EQ(recording.events.front().channel, kRecordingOpened.name) << path;
  const auto opened = Decode<fsmsg::recording_opened_t>(recording.events.front().message);
  EXPECT_TRUE(opened.ok()) << path;
  recording.opened = opened.ok() ? *opened : fsmsg::recording_opened_t{};
  if (recording.events.back().channel == kRecordingClosed.name) {
    const auto closed = Decode<fsmsg::recording_closed_t>(recording.events.back().message);
    EXPECT_TRUE(closed.ok()) << path;
    recording.closed = *closed;
    CheckTotals(recording);
  }
  EXPECT_EQ(recording.name.closed, recording.closed.has_value()) << path;
  CheckOrder(recording);
  return recording;
}

}  // namespace

std::vector<Bytes> Recording::On(const std::string& channel) const {
  std::vector<Bytes> messages;
  for (const LogEvent& event : events) {
    if (event.channel == channel) {
      messages.push_back(event.message);
    }
  }
  return messages;
}

std::vector<Recording> ReadRecordings(const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().filename() != "recorder.lock") {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<Recording> recordings;
  std::transform(paths.begin(), paths.end(), std::back_inserter(recordings), Read);
  return recordings;
}

std::vector<Recording> OfPart(const std::vector<Recording>& recordings, int part) {
  std::vector<Recording> found;
  std::copy_if(recordings.begin(), recordings.end(), std::back_inserter(found),
               [part](const Recording& recording) { return recording.name.part == part; });
  return found;
}

std::vector<Recording> OfStation(const std::vector<Recording>& recordings) {
  std::vector<Recording> found;
  std::copy_if(recordings.begin(), recordings.end(), std::back_inserter(found),
               [](const Recording& recording) { return !recording.name.part.has_value(); });
  return found;
}

}  // namespace forgescan::testing
