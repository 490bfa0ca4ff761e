// The recorder on a simulated bus: what is in its files.
#include <gmock/gmock.h>

#include "tests/services/recorder/recorder_rig.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Recorder = fsmsg::recorder_state_t;
using RecorderServiceTest = RecorderRig;

TEST_F(RecorderServiceTest, Starts) {
  Start();
  EXPECT_EQ(monitor_.state(), ServiceState::kReady);
  ASSERT_FALSE(states_.empty());
  EXPECT_EQ(states_.back().status, Recorder::STATUS_RECORDING);
  EXPECT_GT(states_.back().free_bytes, 0);
  const auto recordings = Stop();
  ASSERT_EQ(recordings.size(), 1u);
  ASSERT_TRUE(recordings[0].closed.has_value());
  EXPECT_EQ(recordings[0].opened.part, -1);
  EXPECT_EQ(recordings[0].opened.volume, 1);
  EXPECT_THAT(recordings[0].closed->gaps, IsEmpty());
}

TEST_F(RecorderServiceTest, SaysTwiceASecondThatItRecords) {
  Start();
  states_.clear();
  Run(10);
  EXPECT_EQ(states_.size(), 20u);
}

TEST_F(RecorderServiceTest, APartsFileHoldsEverythingSaidOfIt) {
  Start();
  LineScript line(world_, 100'000);
  line.Part(7, 2, Pause());
  Run(3);
  Settle();
  EXPECT_EQ(monitor_.counter("parts_complete"), 1);
  const auto parts = OfPart(Stop(), 7);
  ASSERT_EQ(parts.size(), 1u);
  const Recording& part = parts[0];
  EXPECT_THAT(part.path, HasSubstr("_part000007_OK.lcmlog"));
  ASSERT_TRUE(part.closed.has_value());
  EXPECT_THAT(part.closed->gaps, IsEmpty());
  EXPECT_EQ(part.closed->verdict, fsmsg::verdict_t::VERDICT_OK);
  std::size_t of_streams = 0;
  for (const ChannelInfo& channel : AllChannels()) {
    of_streams += channel.kind == ChannelKind::kStream ? part.On(channel.name).size() : 0;
  }
  EXPECT_EQ(of_streams, line.SaidOf(7));
  EXPECT_EQ(part.On("FRAME_LEFT").size(), 4u);
  EXPECT_EQ(part.On("RECONSTRUCTION_TIME").size(), 2u) << "whose part stands elsewhere in the message";
  EXPECT_GT(part.On("SERVICE_STATE").size(), 0u);
  EXPECT_GT(part.On("RECORDER_STATE").size(), 0u);
  EXPECT_THAT(part.On("STREAM_STATUS"), IsEmpty());
}

TEST_F(RecorderServiceTest, ItsBeginningSaysWhatProducedItAndHowToReadIt) {
  Start();
  LineScript(world_, 100).Part(7, 1, Pause());
  Run(3);
  const auto parts = OfPart(Stop(), 7);
  ASSERT_EQ(parts.size(), 1u);
  const auto& opened = parts[0].opened;
  EXPECT_EQ(opened.part, 7);
  EXPECT_EQ(opened.station, "test");
  EXPECT_EQ(opened.version, "1.2.3");
  EXPECT_EQ(opened.build, "compiler");
  EXPECT_EQ(opened.config_hash, "abcd");
  EXPECT_EQ(opened.channel_count, static_cast<int>(AllChannels().size()));
  EXPECT_THAT(opened.types, HasSubstr("struct frame_t {"));
  ASSERT_EQ(opened.file_count, 1);
  ASSERT_EQ(parts[0].events[1].channel, "RECORDED_FILE");
  const auto file = Decode<fsmsg::recorded_file_t>(parts[0].events[1].message);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file->name, "station.toml");
  EXPECT_EQ(std::string(file->data.begin(), file->data.end()), "# a station\n");
}

TEST_F(RecorderServiceTest, FilesOfTheStationAreReadAnewForEveryPart) {
  Start();
  std::ofstream(base_ / "station.toml") << "# changed\n";
  LineScript line(world_, 100);
  line.Part(1, 1, Pause());
  Run(3);
  service_->Drain();
  fs::remove(base_ / "station.toml");
  line.Part(2, 1, Pause());
  Run(3);
  const auto recordings = Stop();
  const auto first = OfPart(recordings, 1), second = OfPart(recordings, 2);
  ASSERT_EQ(first.size() + second.size(), 2u);
  EXPECT_EQ(Decode<fsmsg::recorded_file_t>(first[0].events[1].message)->size, 10);
  EXPECT_EQ(second[0].opened.file_count, 0);
  ASSERT_EQ(second[0].closed->gaps.size(), 1u) << "a part cannot be computed again without it";
  EXPECT_EQ(second[0].closed->gaps[0].channel, "RECORDED_FILE");
}

TEST_F(RecorderServiceTest, TakesPartInResending) {
  Start();
  network_.SetFaults({.loss = 0.2, .large_loss = 0.8, .duplicate = 0.2, .jitter_us = 30'000});
  LineScript line(world_, 300'000);
  line.Part(7, 3, Pause());
  Run(20);
  const auto parts = OfPart(Stop(), 7);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_THAT(parts[0].closed->gaps, IsEmpty());
  EXPECT_EQ(parts[0].On("FRAME_LEFT").size(), 6u);
  EXPECT_GT(hub_.counters().recovered, 0);
}

TEST_F(RecorderServiceTest, WhatIsLostForGoodIsAGapOfThePartAndOfTheStation) {
  Start();
  StreamHub forgetful(network_.AddNode(), "forgetful", {.history_bytes = 1, .burst_bytes = 1});
  LineScript line(forgetful, 100);
  line.Begin(7, Pause());
  network_.SetFaults({.loss = 1.0});
  line.View(7, 0, [] {});
  Run(0.001);
  network_.SetFaults({});
  line.View(7, 1, Pause());
  line.End(7, Pause(), 2);
  Run(20);
  EXPECT_GT(monitor_.counter("gaps"), 0);
  const auto recordings = Stop();
  const auto parts = OfPart(recordings, 7);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_THAT(parts[0].path, HasSubstr("_NOT_OK_INCOMPLETE.lcmlog"));
  EXPECT_FALSE(parts[0].closed->gaps.empty());
  EXPECT_EQ(parts[0].closed->gaps[0].session, forgetful.session());
  EXPECT_GT(parts[0].closed->gaps[0].first_sequence, 0);
  EXPECT_EQ(OfStation(recordings)[0].closed->gaps.size(), parts[0].closed->gaps.size());
}

TEST_F(RecorderServiceTest, StoppedInTheMiddleOfAPartItSaysSoAndHasWhatCame) {
  Start();
  LineScript line(world_, 1000);
  line.Begin(7, Pause());
  line.View(7, 0, Pause());
  const auto parts = OfPart(Stop(), 7);
  ASSERT_EQ(parts.size(), 1u);
  ASSERT_EQ(parts[0].closed->gaps.size(), 1u);
  EXPECT_THAT(parts[0].closed->gaps[0].reason, HasSubstr("stopped before the part was finished"));
  EXPECT_EQ(parts[0].On("FRAME_RIGHT").size(), 2u);
}

TEST_F(RecorderServiceTest, OneThatBeginsInTheMiddleOfAPartSaysWhatItDidNotHear) {
  LineScript line(world_, 1000);
  line.Begin(7, Pause());
  line.View(7, 0, Pause());
  Start();
  line.View(7, 1, Pause());
  line.End(7, Pause(), 1);
  Run(3);
  line.Part(8, 1, Pause());
  Run(3);
  const auto recordings = Stop();
  const auto parts = OfPart(recordings, 7);
  ASSERT_EQ(parts.size(), 1u);
  ASSERT_FALSE(parts[0].closed->gaps.empty());
  EXPECT_EQ(parts[0].closed->gaps[0].channel, "PART_ARRIVED");
  EXPECT_THAT(OfPart(recordings, 8)[0].closed->gaps, IsEmpty()) << "the next one is whole";
}

TEST_F(RecorderServiceTest, ASenderThatStartsAnewIsNoGapByItself) {
  Start();
  {
    StreamHub first(network_.AddNode(), "line");
    LineScript line(first, 1000);
    line.Begin(7, Pause());
    line.View(7, 0, Pause());
    Run(0.1);
  }
  StreamHub second(network_.AddNode(), "line");
  LineScript line(second, 1000);
  line.View(7, 1, Pause());
  line.End(7, Pause(), 1);
  Run(3);
  const auto parts = OfPart(Stop(), 7);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_THAT(parts[0].closed->gaps, IsEmpty());
  EXPECT_EQ(parts[0].On("FRAME_LEFT").size(), 4u);
}

// How much is left out depends on the disk of the moment; that nothing goes unsaid does not.
TEST_F(RecorderServiceTest, AskedToStopItWaitsForTheNewsOfASortedPart) {
  Start();
  LineScript(world_, 1000).Part(7, 1, Pause());
  bool done = false;
  service_->FinishThen([&] { done = true; });
  Run(1);
  EXPECT_FALSE(done);
  Run(2);
  EXPECT_TRUE(done);
  EXPECT_THAT(OfPart(Stop(), 7)[0].closed->gaps, IsEmpty());
}

TEST_F(RecorderServiceTest, AskedToStopItDoesNotWaitForAPartInWork) {
  Start();
  LineScript(world_, 1000).Begin(7, Pause());
  bool done = false;
  service_->FinishThen([&] { done = true; });
  Run(0.2);
  EXPECT_TRUE(done);
}

TEST_F(RecorderServiceTest, WhatARecorderThatDiedHasLeftIsNamedAndNotTouched) {
  const std::string left = NameOf({network_.NowUs(), 7, 0, false, false});
  fs::create_directories(base_ / "recordings/parts");
  std::ofstream(base_ / "recordings/parts" / left) << "half an event";
  Start();
  EXPECT_EQ(monitor_.counter("recordings_left_open"), 1);
  EXPECT_THAT(monitor_.last_error(), HasSubstr(left));
  LineScript(world_, 1000).Part(7, 1, Pause());
  Run(3);
  service_.reset();
  EXPECT_EQ(fs::file_size(base_ / "recordings/parts" / left), 13u);
}

// The closing event alone does not fit any more.

}  // namespace
}  // namespace forgescan::testing
