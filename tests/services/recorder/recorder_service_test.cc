// The recorder on a simulated bus: what is in its files.
#include "services/recorder/recorder_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "tests/services/recorder/line_script.h"
#include "tests/services/recorder/recordings.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Recorder = fsmsg::recorder_state_t;

constexpr std::int64_t kSecondUs = 1'000'000;

class RecorderServiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    base_ = fs::path(::testing::TempDir()) / ("forgescan_recorder_" + std::to_string(getpid()));
    fs::remove_all(base_);
    fs::create_directories(base_);
    config_.folder = (base_ / "recordings").string();
    config_.min_free_mb = 1;
    std::ofstream(base_ / "station.toml") << "# a station\n";
    station_ = {"test", "1.2.3", "compiler", "abcd", {{"station.toml", (base_ / "station.toml").string()}}};
    SubscribeState<Recorder>(world_.bus(), kRecorderState,
                             [this](const Recorder& m) { states_.push_back(m); });
  }
  void TearDown() override {
    service_.reset();
    fs::remove_all(base_);
  }
  void Start() {
    auto service = RecorderService::Create(hub_, monitor_, config_, station_);
    ASSERT_TRUE(service.ok()) << service.error().message;
    service_ = *std::move(service);
    Settle();
  }
  // Until the writer has done what it was told, and the service knows.
  void Settle() {
    service_->Drain();
    network_.RunFor(kSecondUs);
  }
  void Run(double seconds) { network_.RunFor(static_cast<std::int64_t>(seconds * 1e6)); }
  std::vector<Recording> Stop() {
    service_.reset();
    return ReadRecordings(config_.folder);
  }
  std::function<void()> Pause() {
    return [this] { network_.RunFor(2'000); };
  }

  fs::path base_;
  SimNetwork network_{3};
  RecorderConfig config_;
  RecordedStation station_;
  StreamHub hub_{network_.AddNode(), "recorder"};
  ServiceMonitor monitor_{hub_, "recorder", "abcd"};
  StreamHub world_{network_.AddNode(), "world"};
  std::vector<Recorder> states_;
  std::unique_ptr<RecorderService> service_;
};

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
TEST_F(RecorderServiceTest, WhatTheDiskIsTooSlowForIsLeftOutByNumber) {
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

TEST_F(RecorderServiceTest, WithTooLittleSpaceItStopsAndSaysSo) {
  config_.min_free_mb = 1'000'000'000;
  Start();
  ASSERT_FALSE(states_.empty());
  EXPECT_EQ(states_.back().status, Recorder::STATUS_STOPPED);
  EXPECT_THAT(states_.back().reason, HasSubstr("1000000000 MB are needed"));
  LineScript(world_, 1000).Part(7, 1, Pause());
  Run(3);
  EXPECT_EQ(monitor_.counter("parts_not_recorded"), 1);
  const auto recordings = Stop();
  EXPECT_THAT(OfPart(recordings, 7), IsEmpty());
  EXPECT_THAT(OfStation(recordings).at(0).closed->gaps.at(0).reason, HasSubstr("part 7 is not recorded"));
}

TEST_F(RecorderServiceTest, AFailedWriteIsLoudLeavesWholeEventsAndTheNextPartIsRecorded) {
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

TEST_F(RecorderServiceTest, AFolderThatCannotBeMadeStopsItAtTheStart) {
  std::ofstream(base_ / "file") << "no folder";
  config_.folder = (base_ / "file").string();
  const auto service = RecorderService::Create(hub_, monitor_, config_, station_);
  ASSERT_FALSE(service.ok());
  EXPECT_THAT(service.error().message, HasSubstr("cannot be kept in"));
}

}  // namespace
}  // namespace forgescan::testing
