// Which file a message goes to, and when a part's file is closed.
#include "services/recorder/recording_machine.h"

#include <gmock/gmock.h>

#include "tests/services/recorder/machine_rig.h"

namespace forgescan::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using RecordingMachineTest = MachineRig;

constexpr FileId kStation = 1;

TEST_F(RecordingMachineTest, Starts) {
  ASSERT_EQ(files_.size(), 1u);
  EXPECT_FALSE(files_[kStation].part.has_value());
  EXPECT_EQ(files_[kStation].volume, 1);
  EXPECT_EQ(machine_.Trouble(), "");
}

TEST_F(RecordingMachineTest, NothingIsRecordedBeforeTheStationsFileIsOpen) {
  RecordingMachine machine(config_);
  const auto actions = machine.Start(now_us_);
  EXPECT_THAT(machine.Trouble(), HasSubstr("not open yet"));
  machine.OnOpened(1);
  EXPECT_EQ(machine.Trouble(), "");
}

TEST_F(RecordingMachineTest, APartGetsAFileThatEndsWhenItIsSortedAndQuiet) {
  const FileId file = WholePart(7);
  EXPECT_EQ(files_[file].part, 7);
  EXPECT_EQ(files_[file].messages, 4);
  EXPECT_TRUE(machine_.finishing());
  Wait(1.9);
  EXPECT_TRUE(IsOpen(file));
  Wait(0.2);
  EXPECT_THAT(Closed(file).gaps, IsEmpty());
  EXPECT_EQ(Closed(file).verdict, fsmsg::verdict_t::VERDICT_OK);
  EXPECT_EQ(Closed(file).reason, "the part was sorted");
  EXPECT_FALSE(machine_.finishing());
  EXPECT_EQ(machine_.open_parts(), 0);
}

TEST_F(RecordingMachineTest, LateNewsPutTheEndOff) {
  const FileId file = WholePart(7);
  const std::int64_t utime = now_us_;
  Wait(1.5);
  EXPECT_THAT(Say(Kind::kStream, 7, utime), ElementsAre(file));
  Wait(1.5);
  EXPECT_TRUE(IsOpen(file));
  Wait(0.6);
  EXPECT_FALSE(IsOpen(file));
}

TEST_F(RecordingMachineTest, WaitsUntilTheSendersHaveSaidWhatTheySent) {
  const FileId file = WholePart(7);
  const std::int64_t last_us = now_us_;
  Wait(3, 0);
  Wait(3, last_us - 1);
  EXPECT_TRUE(IsOpen(file));
  Wait(0.1, last_us);
  EXPECT_FALSE(IsOpen(file));
}

TEST_F(RecordingMachineTest, APartMayOpenWithAnyOfItsMessages) {
  const FileId file = Say(Kind::kStream, 7, now_us_ + 100).at(0);
  EXPECT_THAT(Say(Kind::kArrived, 7, now_us_ + 50), ElementsAre(file)) << "it was overtaken";
  Say(Kind::kJudged, 7);
  Say(Kind::kSorted, 7, now_us_ + 200);
  Wait(3);
  EXPECT_THAT(Closed(file).gaps, IsEmpty());
}

TEST_F(RecordingMachineTest, APartWhoseArrivalWasNotHeardSaysSo) {
  const FileId file = Say(Kind::kStream, 7).at(0);
  Say(Kind::kSorted, 7);
  Wait(3);
  ASSERT_EQ(Closed(file).gaps.size(), 1u);
  EXPECT_EQ(Closed(file).gaps[0].channel, "PART_ARRIVED");
}

TEST_F(RecordingMachineTest, TwoPartsAreKeptApart) {
  const FileId one = Say(Kind::kArrived, 1).at(0), two = Say(Kind::kArrived, 2).at(0);
  EXPECT_NE(one, two);
  EXPECT_THAT(Say(Kind::kStream, 1), ElementsAre(one));
  EXPECT_THAT(Say(Kind::kStream, 2), ElementsAre(two));
  EXPECT_EQ(machine_.open_parts(), 2);
  Say(Kind::kSorted, 1);
  Wait(3);
  EXPECT_FALSE(IsOpen(one));
  EXPECT_TRUE(IsOpen(two));
}

TEST_F(RecordingMachineTest, AStateGoesToTheStationAndToEveryOpenPart) {
  const FileId one = Say(Kind::kArrived, 1).at(0), two = Say(Kind::kArrived, 2).at(0);
  EXPECT_THAT(Say(Kind::kState, std::nullopt), ElementsAre(kStation, one, two));
  Say(Kind::kSorted, 1);
  Say(Kind::kSorted, 2);
  Wait(3);
  EXPECT_THAT(Say(Kind::kState, std::nullopt), ElementsAre(kStation));
}

TEST_F(RecordingMachineTest, AStateKeepsNoPartOpen) {
  const FileId file = WholePart(7);
  for (int i = 0; i < 25; ++i) {
    Say(Kind::kState, std::nullopt);
    Wait(0.1);
  }
  EXPECT_FALSE(IsOpen(file));
}

TEST_F(RecordingMachineTest, WhatBelongsToNoPartGoesToTheStation) {
  EXPECT_THAT(Say(Kind::kStream, std::nullopt), ElementsAre(kStation));
  EXPECT_THAT(Say(Kind::kStream, 0), ElementsAre(kStation));
  EXPECT_THAT(Say(Kind::kArrived, -3), ElementsAre(kStation));
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(RecordingMachineTest, WhatComesAfterAPartWasClosedGoesToTheStationAndIsCounted) {
  WholePart(7);
  const std::int64_t utime = now_us_;
  Wait(3);
  EXPECT_THAT(Say(Kind::kStream, 7, utime), ElementsAre(kStation));
  ASSERT_EQ(notes_.size(), 1u);
  EXPECT_EQ(notes_[0].what, RecordingNote::What::kLate);
}

TEST_F(RecordingMachineTest, AVerdictWithoutSortingEndsAPartAfterAWhile) {
  const FileId file = Say(Kind::kArrived, 7).at(0);
  Say(Kind::kJudged, 7);
  Wait(29);
  EXPECT_TRUE(IsOpen(file));
  Wait(2);
  EXPECT_THAT(Closed(file).reason, HasSubstr("no word of sorting within 30 s"));
  EXPECT_THAT(Closed(file).gaps, IsEmpty());
}

TEST_F(RecordingMachineTest, APartOfWhichNothingMoreIsHeardIsClosedWithAGap) {
  const FileId file = Say(Kind::kArrived, 7).at(0);
  Wait(239);
  EXPECT_TRUE(IsOpen(file));
  Wait(2, 0);
  ASSERT_EQ(Closed(file).gaps.size(), 1u);
  EXPECT_THAT(Closed(file).gaps[0].reason, HasSubstr("240 s"));
  EXPECT_EQ(Closed(file).verdict, fsmsg::verdict_t::VERDICT_UNKNOWN);
  EXPECT_NE(WholePart(8), file) << "the next one is recorded";
}

TEST_F(RecordingMachineTest, StoppingClosesWithAGapWhatWasNotFinished) {
  const FileId done = WholePart(7);
  now_us_ += 2 * kSecondUs;
  const FileId unfinished = Say(Kind::kArrived, 8).at(0);
  Take(machine_.OnStop(now_us_, kFarUs));
  EXPECT_THAT(Closed(done).gaps, IsEmpty());
  ASSERT_EQ(Closed(unfinished).gaps.size(), 1u);
  EXPECT_THAT(Closed(unfinished).gaps[0].reason, HasSubstr("stopped before the part was finished"));
  Take(machine_.OnEnd(now_us_));
  EXPECT_THAT(Closed(kStation).gaps, IsEmpty());
}

TEST_F(RecordingMachineTest, TooManyOpenPartsEndTheOldest) {
  const FileId first = Say(Kind::kArrived, 1).at(0);
  for (int part = 2; part <= 8; ++part) {
    Say(Kind::kArrived, part);
  }
  EXPECT_TRUE(IsOpen(first));
  Say(Kind::kArrived, 9);
  EXPECT_THAT(Closed(first).reason, HasSubstr("more than 8 parts"));
  EXPECT_EQ(Closed(first).gaps.size(), 1u);
  EXPECT_EQ(machine_.open_parts(), 8);
}

TEST_F(RecordingMachineTest, AHoleIsOneOfEveryOpenFile) {
  const FileId one = Say(Kind::kArrived, 1).at(0), two = Say(Kind::kArrived, 2).at(0);
  fsmsg::recording_gap_t gap{};
  gap.channel = "FRAME_LEFT";
  gap.session = 5;
  gap.first_sequence = gap.last_sequence = 9;
  machine_.OnLost(gap);
  const FileId three = Say(Kind::kArrived, 3).at(0);
  machine_.OnDropped(three, gap);
  Take(machine_.OnStop(now_us_, kFarUs));
  Take(machine_.OnEnd(now_us_));
  for (const FileId file : {one, two, three}) {
    ASSERT_EQ(Closed(file).gaps.size(), 2u);
    EXPECT_EQ(Closed(file).gaps[0].first_sequence, 9);
  }
  EXPECT_EQ(Closed(kStation).gaps.size(), 1u) << "a part's message the disk was too slow for is none of it";
}

TEST(RecorderConfig, WrongValuesAreRefusedByName) {
  EXPECT_TRUE(RecorderConfig{}.Check().ok());
  RecorderConfig config;
  config.settle_s = 40;
  EXPECT_THAT(config.Check().error().message, HasSubstr("settle_s 40"));
  config = {};
  config.backlog_mb = 20;
  EXPECT_THAT(config.Check().error().message, HasSubstr("100..16000"));
  const auto file = ConfigFile::Parse("[recorder]\nquota_gb = 0\n", "station.toml");
  ASSERT_TRUE(file.ok());
  EXPECT_THAT(RecorderConfig::Load(file->Table("recorder")).error().message, HasSubstr("quota_gb"));
  const auto empty = ConfigFile::Parse("", "station.toml");
  EXPECT_TRUE(RecorderConfig::Load(empty->Table("recorder")).ok());
}

}  // namespace
}  // namespace forgescan::testing
