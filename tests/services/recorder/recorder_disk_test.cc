// The recorder on a simulated bus: disks that are slow, full, or refuse.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>

#include "tests/services/recorder/recorder_rig.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Recorder = fsmsg::recorder_state_t;
using RecorderDiskTest = RecorderRig;

TEST_F(RecorderDiskTest, WhatTheDiskIsTooSlowForIsLeftOutByNumber) {
  config_.backlog_mb = 100;
  std::ofstream(base_ / "large");
  fs::resize_file(base_ / "large", 60'000'000);
  for (const char* name : {"a", "b", "c"}) {
    station_.files.push_back({name, (base_ / "large").string()});
  }
  Start();
  StreamHub sender(network_.AddNode(), "sender", {.history_bytes = 1, .burst_bytes = 1});
  LineScript line(sender, 5'000'000);
  line.Begin(7, Pause());
  for (int view = 0; view < 10; ++view) {
    line.View(7, view, Pause());
  }
  line.End(7, Pause(), 1);
  Settle();
  Run(3);
  const std::int64_t dropped = monitor_.counter("messages_dropped");
  RecordProperty("dropped", static_cast<int>(dropped));
  const auto parts = OfPart(Stop(), 7);
  ASSERT_EQ(parts.size(), 1u);
  ASSERT_TRUE(parts[0].closed.has_value());
  std::size_t admitted = 0, held = 0;
  for (const fsmsg::recording_gap_t& gap : parts[0].closed->gaps) {
    EXPECT_THAT(gap.reason, HasSubstr("the disk was too slow"));
    admitted +=
        gap.first_sequence == 0 ? 0 : static_cast<std::size_t>(gap.last_sequence - gap.first_sequence + 1);
  }
  for (const ChannelInfo& channel : AllChannels()) {
    held += channel.kind == ChannelKind::kStream ? parts[0].On(channel.name).size() : 0;
  }
  EXPECT_EQ(held + admitted, line.SaidOf(7));
  EXPECT_EQ(parts[0].name.complete, dropped == 0);
}

TEST_F(RecorderDiskTest, WithTooLittleSpaceItStopsAndSaysSo) {
  config_.min_free_mb = 1'000'000;
  Start();
  ASSERT_FALSE(states_.empty());
  EXPECT_EQ(states_.back().status, Recorder::STATUS_STOPPED);
  EXPECT_THAT(states_.back().reason, HasSubstr("1000000 MB are needed"));
  LineScript(world_, 1000).Part(7, 1, Pause());
  Run(3);
  EXPECT_EQ(monitor_.counter("parts_not_recorded"), 1);
  const auto recordings = Stop();
  EXPECT_THAT(OfPart(recordings, 7), IsEmpty());
  EXPECT_THAT(OfStation(recordings).at(0).closed->gaps.at(0).reason, HasSubstr("part 7 is not recorded"));
}

TEST_F(RecorderDiskTest, AFailedWriteIsLoudLeavesWholeEventsAndTheNextPartIsRecorded) {
  Start();
  LineScript line(world_, 500'000);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  void (*signal)(int) = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{1'200'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  line.Begin(7, Pause());
  line.View(7, 0, Pause());
  Settle();
  EXPECT_EQ(monitor_.state(), ServiceState::kError);
  EXPECT_EQ(states_.back().status, Recorder::STATUS_STOPPED);
  EXPECT_THAT(states_.back().reason, HasSubstr("File too large"));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, signal);
  line.End(7, Pause(), 1);
  Run(3);
  EXPECT_EQ(states_.back().status, Recorder::STATUS_RECORDING);
  line.Part(8, 1, Pause());
  Run(3);
  const auto recordings = Stop();
  const auto broken = OfPart(recordings, 7);
  ASSERT_EQ(broken.size(), 1u);
  EXPECT_FALSE(broken[0].closed.has_value());
  EXPECT_EQ(broken[0].On("FRAME_LEFT").size(), 1u);
  EXPECT_THAT(OfPart(recordings, 8).at(0).closed->gaps, IsEmpty());
  EXPECT_THAT(OfStation(recordings).at(0).closed->gaps.at(0).reason, HasSubstr("part 7"));
}

TEST_F(RecorderDiskTest, AFileThatCannotBeClosedIsLoudAndInTheStationsFile) {
  Start();
  LineScript line(world_, 1000);
  line.Part(7, 1, Pause());
  service_->Drain();
  for (const auto& entry : fs::directory_iterator(base_ / "recordings/parts")) {
    fs::remove(entry.path());  // it can still be written, but gets no name any more
  }
  Run(3);
  Settle();
  EXPECT_EQ(states_.back().status, Recorder::STATUS_STOPPED);
  EXPECT_THAT(states_.back().reason, HasSubstr("cannot be renamed"));
  Run(12);
  EXPECT_EQ(states_.back().status, Recorder::STATUS_RECORDING);
  line.Begin(8, Pause());
  service_->Drain();
  for (const auto& entry : fs::directory_iterator(base_ / "recordings/parts")) {
    fs::remove(entry.path());
  }
  const auto recordings = Stop();
  const auto gaps = OfStation(recordings).at(0).closed->gaps;
  ASSERT_EQ(gaps.size(), 2u);
  EXPECT_THAT(gaps[0].reason, HasSubstr("part 7 could not be closed"));
  EXPECT_THAT(gaps[1].reason, HasSubstr("part 8 could not be closed")) << "while the recorder stopped";
}

TEST_F(RecorderDiskTest, WhileTheDiskRefusesNoEmptyFilesPileUp) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  void (*signal)(int) = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{100, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  Start();
  for (int i = 0; i < 12; ++i) {
    service_->Drain();
    Run(5);
  }
  service_.reset();
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, signal);
  EXPECT_GE(monitor_.counter("write_failures"), 3);
  EXPECT_THAT(ReadRecordings(config_.folder), IsEmpty());
}

TEST_F(RecorderDiskTest, AFolderThatCannotBeMadeStopsItAtTheStart) {
  std::ofstream(base_ / "file") << "no folder";
  config_.folder = (base_ / "file").string();
  const auto service = RecorderService::Create(hub_, monitor_, config_, station_);
  ASSERT_FALSE(service.ok());
  EXPECT_THAT(service.error().message, HasSubstr("cannot be kept in"));
}

}  // namespace
}  // namespace forgescan::testing
