// Parts with the same number, volumes of the station, and what happens when the disk fails or is full.
#include <gmock/gmock.h>

#include "tests/services/recorder/machine_rig.h"

namespace forgescan::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using RecordingRulesTest = MachineRig;

constexpr FileId kStation = 1;

TEST_F(RecordingRulesTest, TheSameNumberAfterItsPartWasClosedIsANewPart) {
  const FileId first = WholePart(7);
  Wait(3);
  const FileId second = WholePart(7);
  EXPECT_NE(first, second);
  Wait(3);
  EXPECT_THAT(Closed(second).gaps, IsEmpty());
}

TEST_F(RecordingRulesTest, TheSameNumberBeforeTheFileIsClosedIsANewPartToo) {
  const FileId first = WholePart(7);
  const std::int64_t sorted_utime = now_us_;
  Wait(1);
  const FileId second = Say(Kind::kStream, 7).at(0);
  EXPECT_NE(first, second) << "later than the sorting of the first";
  EXPECT_THAT(Say(Kind::kArrived, 7, now_us_ - 10), ElementsAre(second));
  EXPECT_THAT(Say(Kind::kStream, 7, sorted_utime), ElementsAre(first)) << "late news of the first";
}

TEST_F(RecordingRulesTest, AnUnfinishedPartAndTheNextOneWithItsNumberAreToldApartByTime) {
  const FileId first = Say(Kind::kArrived, 7).at(0);
  const std::int64_t first_utime = now_us_;
  Wait(10);
  const FileId second = Say(Kind::kArrived, 7).at(0);
  EXPECT_NE(first, second);
  EXPECT_THAT(Say(Kind::kStream, 7, first_utime + 5), ElementsAre(first));
  EXPECT_THAT(Say(Kind::kStream, 7), ElementsAre(second));
  EXPECT_THAT(Say(Kind::kJudged, 7, first_utime + 6), ElementsAre(first));
  EXPECT_THAT(Say(Kind::kSorted, 7), ElementsAre(first)) << "the one that has its verdict";
  EXPECT_THAT(Say(Kind::kJudged, 7), ElementsAre(second));
  EXPECT_THAT(Say(Kind::kSorted, 7), ElementsAre(second));
  Wait(3);
  EXPECT_THAT(Closed(first).gaps, IsEmpty());
  EXPECT_THAT(Closed(second).gaps, IsEmpty());
}

TEST_F(RecordingRulesTest, WhatCameBeforeALateArrivalMayBeInTheFileOfTheOtherPart) {
  Say(Kind::kArrived, 7);
  Wait(10);
  const std::int64_t arrival_utime = now_us_;
  Say(Kind::kStream, 7, arrival_utime + 100);  // of the next part, whose arrival is still to come
  const FileId second = Say(Kind::kArrived, 7, arrival_utime).at(0);
  Say(Kind::kSorted, 7, arrival_utime + 200);
  Wait(3);
  ASSERT_EQ(Closed(second).gaps.size(), 1u);
  EXPECT_THAT(Closed(second).gaps[0].reason, HasSubstr("earlier part with this number"));
}

TEST_F(RecordingRulesTest, EveryDayBeginsAVolume) {
  Say(Kind::kState, std::nullopt);
  Wait(22 * 3600);
  EXPECT_TRUE(IsOpen(kStation));
  Wait(3600);
  EXPECT_EQ(Closed(kStation).reason, "the next volume follows");
  ASSERT_EQ(files_.size(), 2u);
  EXPECT_EQ(files_[2].volume, 2);
  EXPECT_EQ(machine_.Trouble(), "") << "recording goes on meanwhile";
  EXPECT_THAT(Say(Kind::kState, std::nullopt), ElementsAre(2));
}

TEST_F(RecordingRulesTest, AFullVolumeIsFollowedByAnother) {
  RecordedMessage message;
  message.kind = Kind::kState;
  message.now_us = now_us_;
  message.bytes = config_.station_volume_mb * std::int64_t{1'000'000};
  Take(machine_.OnMessage(message));
  Wait(0.1);
  EXPECT_FALSE(IsOpen(kStation));
  EXPECT_TRUE(IsOpen(2));
}

TEST_F(RecordingRulesTest, WithoutSpaceNoPartIsBegunAndItIsSaid) {
  machine_.SetSpace("12 MB are free");
  EXPECT_EQ(machine_.Trouble(), "12 MB are free");
  EXPECT_THAT(Say(Kind::kArrived, 7), IsEmpty());
  EXPECT_THAT(Say(Kind::kStream, 7), IsEmpty());
  ASSERT_EQ(notes_.size(), 3u);
  EXPECT_THAT(notes_[0].text, HasSubstr("part 7 is not recorded: 12 MB are free"));
  EXPECT_EQ(machine_.open_parts(), 0);
  machine_.SetSpace("");
  EXPECT_EQ(machine_.Trouble(), "");
  EXPECT_THAT(Say(Kind::kStream, 7), IsEmpty()) << "not from its middle on";
  const FileId next = WholePart(8);
  Wait(3);
  EXPECT_THAT(Closed(next).gaps, IsEmpty());
  Take(machine_.OnEnd(now_us_));
  ASSERT_EQ(Closed(kStation).gaps.size(), 1u);
  EXPECT_THAT(Closed(kStation).gaps[0].reason, HasSubstr("part 7"));
}

TEST_F(RecordingRulesTest, AFileThatFailsIsLeftAndTheNextPartIsRecorded) {
  const FileId broken = Say(Kind::kArrived, 7).at(0);
  machine_.OnOpened(broken);
  machine_.OnFailed(broken, "No space left on device", now_us_);
  EXPECT_EQ(machine_.Trouble(), "No space left on device");
  EXPECT_THAT(Say(Kind::kStream, 7), IsEmpty());
  EXPECT_THAT(Say(Kind::kState, std::nullopt), ElementsAre(kStation));
  const FileId next = Say(Kind::kArrived, 8).at(0);
  Say(Kind::kSorted, 7);
  Wait(3);
  EXPECT_TRUE(IsOpen(broken)) << "it has no closing event";
  EXPECT_EQ(machine_.Trouble(), "");
  Say(Kind::kSorted, 8);
  Wait(3);
  EXPECT_THAT(Closed(next).gaps, IsEmpty());
}

TEST_F(RecordingRulesTest, AfterAFailureTheStationGetsANewVolumeWhenThereIsSpace) {
  machine_.OnFailed(kStation, "No space left on device", now_us_);
  EXPECT_EQ(machine_.Trouble(), "No space left on device");
  EXPECT_THAT(Say(Kind::kState, std::nullopt), IsEmpty());
  Wait(9);
  EXPECT_EQ(files_.size(), 1u);
  machine_.SetSpace("12 MB are free");
  Wait(2);
  EXPECT_EQ(files_.size(), 1u);
  machine_.SetSpace("");
  Wait(1);
  ASSERT_EQ(files_.size(), 2u);
  EXPECT_NE(machine_.Trouble(), "") << "not before it is open";
  machine_.OnOpened(2);
  EXPECT_EQ(machine_.Trouble(), "");
  Take(machine_.OnEnd(now_us_));
  ASSERT_EQ(Closed(2).gaps.size(), 1u);
  EXPECT_THAT(Closed(2).gaps[0].reason, HasSubstr("broke off"));
}

TEST_F(RecordingRulesTest, AChainOfVolumesThatCannotBeOpenedIsSaidOnceAndTriedEverMoreSeldom) {
  machine_.OnFailed(kStation, "No space left on device", now_us_);
  FileId last = kStation;
  for (const double pause_s : {10, 20, 40, 80, 80}) {
    Wait(pause_s - 0.1);
    EXPECT_FALSE(files_.contains(last + 1)) << "after less than " << pause_s << " s";
    Wait(0.1);
    ASSERT_TRUE(files_.contains(++last)) << "after " << pause_s << " s";
    machine_.OnFailed(last, "File " + std::to_string(last) + " too large", now_us_);
  }
  Wait(80);
  machine_.OnOpened(++last);
  Take(machine_.OnEnd(now_us_));
  ASSERT_EQ(Closed(last).gaps.size(), 1u);
  EXPECT_THAT(Closed(last).gaps[0].reason, HasSubstr("No space left on device"));
}

TEST_F(RecordingRulesTest, APartsFileThatCannotBeClosedIsAlarmAndGapOfTheStation) {
  const FileId file = WholePart(7);
  machine_.OnOpened(file);
  Wait(3);
  EXPECT_FALSE(IsOpen(file));
  machine_.OnFailed(file, "File too large", now_us_);
  EXPECT_EQ(machine_.Trouble(), "File too large");
  Wait(9);
  EXPECT_EQ(machine_.Trouble(), "File too large") << "long enough to be heard";
  Wait(2);
  EXPECT_EQ(machine_.Trouble(), "");
  Take(machine_.OnEnd(now_us_));
  ASSERT_EQ(Closed(kStation).gaps.size(), 1u);
  EXPECT_THAT(Closed(kStation).gaps[0].reason, HasSubstr("part 7 could not be closed: File too large"));
}

TEST_F(RecordingRulesTest, AFileThatWasClosedCannotFailAnyMore) {
  const FileId file = WholePart(7);
  Wait(3);
  machine_.OnClosed(file);
  machine_.OnFailed(file, "File too large", now_us_);
  EXPECT_EQ(machine_.Trouble(), "");
}

TEST_F(RecordingRulesTest, AVolumeThatCannotBeClosedIsAGapOfTheNext) {
  Wait(23 * 3600);
  machine_.OnOpened(2);
  machine_.OnFailed(kStation, "File too large", now_us_);
  EXPECT_EQ(machine_.Trouble(), "File too large");
  Take(machine_.OnEnd(now_us_));
  ASSERT_EQ(Closed(2).gaps.size(), 1u);
  EXPECT_THAT(Closed(2).gaps[0].reason, HasSubstr("volume before this one could not be closed"));
}

TEST_F(RecordingRulesTest, AfterTheSendersClockWasSetBackTheNextPartWithTheNumberHasItsFile) {
  WholePart(7);
  const std::int64_t back_us = now_us_ - 3600 * kSecondUs;
  Wait(3);
  const FileId second = Say(Kind::kArrived, 7, back_us).at(0);
  EXPECT_NE(second, kStation);
  EXPECT_THAT(Say(Kind::kStream, 7, back_us + 10), ElementsAre(second));
  Say(Kind::kSorted, 7, back_us + 20);
  Wait(3);
  EXPECT_THAT(Closed(second).gaps, IsEmpty());
}

TEST_F(RecordingRulesTest, WhatCameOfItBeforeItsArrivalIsAGap) {
  WholePart(7);
  const std::int64_t back_us = now_us_ - 3600 * kSecondUs;
  Wait(3);
  EXPECT_THAT(Say(Kind::kStream, 7, back_us + 10), ElementsAre(kStation)) << "nobody can know better";
  const FileId second = Say(Kind::kArrived, 7, back_us).at(0);
  Say(Kind::kSorted, 7, back_us + 20);
  Wait(3);
  ASSERT_EQ(Closed(second).gaps.size(), 1u);
  EXPECT_THAT(Closed(second).gaps[0].reason, HasSubstr("may be in the station's recording"));
}

TEST_F(RecordingRulesTest, AClockSetBackBetweenTwoOpenPartsWithANumberIsAGapOfBoth) {
  const FileId first = WholePart(7);
  const std::int64_t back_us = now_us_ - 3600 * kSecondUs;
  const FileId second = Say(Kind::kArrived, 7, back_us).at(0);
  EXPECT_NE(first, second);
  Say(Kind::kSorted, 7, back_us + 20);
  Wait(3);
  EXPECT_EQ(Closed(first).gaps.size(), 1u);
  EXPECT_EQ(Closed(second).gaps.size(), 1u);
}

TEST_F(RecordingRulesTest, APartThatWasSortedBeforeWhatCameOfItIsNotWhole) {
  const FileId first = Say(Kind::kArrived, 7).at(0);
  Say(Kind::kStream, 7, now_us_ + 100);
  Say(Kind::kSorted, 7, now_us_ - 3600 * kSecondUs);
  EXPECT_THAT(Say(Kind::kStream, 7, now_us_ + 50), ElementsAre(first)) << "no later than what it has";
  EXPECT_NE(Say(Kind::kJudged, 7, now_us_ + 200).at(0), first);
  Wait(3);
  ASSERT_EQ(Closed(first).gaps.size(), 1u);
  EXPECT_THAT(Closed(first).gaps[0].reason, HasSubstr("sorted before what had come of it"));
}

}  // namespace
}  // namespace forgescan::testing
