#include "services/recorder/retention.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fsmsg/verdict_t.hpp"
#include "services/recorder/recording_name.h"

namespace forgescan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Verdict = fsmsg::verdict_t;

constexpr std::int64_t kDayUs = 86'400'000'000, kNowUs = 21'000 * kDayUs;
constexpr std::int64_t kBytes = 1000;

class RetentionTest : public ::testing::Test {
 protected:
  // One part a minute, the first the oldest.
  std::string Add(int part, int verdict, bool complete = true, double age_days = 1) {
    const std::int64_t utime = kNowUs - static_cast<std::int64_t>(age_days * static_cast<double>(kDayUs)) +
                               60'000'000 * static_cast<std::int64_t>(files_.size());
    const std::string path =
        "/r/parts/" + NameOf({utime, part, static_cast<std::int8_t>(verdict), complete, true});
    files_.push_back({path, kBytes, false});
    return path;
  }
  // Of the station, so that there is no long pause.
  std::string AddVolume(double age_days) {
    const std::int64_t utime = kNowUs - static_cast<std::int64_t>(age_days * static_cast<double>(kDayUs));
    files_.push_back({"/r/station/" + NameOf({utime, std::nullopt, 0, true, true}), kBytes, false});
    return files_.back().path;
  }
  RetentionPlan Plan(const FreeSpace& free = {}) const { return PlanRetention(files_, rules_, free, kNowUs); }
  std::vector<std::string> Deleted(const FreeSpace& free = {}) const {
    std::vector<std::string> paths;
    for (const Deletion& deletion : Plan(free).deletions) {
      paths.push_back(deletion.path);
    }
    return paths;
  }

  RetentionRules rules_{
      .keep_days = 30, .keep_every_nth_ok = 4, .keep_newest_ok = 2, .quota_bytes = 1'000'000};
  std::vector<StoredRecording> files_;
};

TEST_F(RetentionTest, Starts) { EXPECT_THAT(Deleted(), IsEmpty()); }

TEST_F(RetentionTest, OfOkPartsEveryNthAndTheNewestStay) {
  std::vector<std::string> paths;
  for (int part = 1; part <= 7; ++part) {
    paths.push_back(Add(part, Verdict::VERDICT_OK));
  }
  EXPECT_THAT(Deleted(), ElementsAre(paths[0], paths[1], paths[2], paths[4]));
}

TEST_F(RetentionTest, AllOthersStay) {
  for (const int verdict : {Verdict::VERDICT_UNKNOWN, Verdict::VERDICT_NOT_OK, Verdict::VERDICT_NOT_DECIDABLE,
                            Verdict::VERDICT_NOT_INSPECTED}) {
    Add(1, verdict);
  }
  Add(1, Verdict::VERDICT_OK, false);
  Add(2, Verdict::VERDICT_OK);
  Add(3, Verdict::VERDICT_OK);
  EXPECT_THAT(Deleted(), IsEmpty());
}

TEST_F(RetentionTest, AfterTheirTimeAllGoButTheNewestOkParts) {
  const auto bad = Add(1, Verdict::VERDICT_NOT_OK, true, 31);
  const auto nth = Add(4, Verdict::VERDICT_OK, true, 31);
  Add(5, Verdict::VERDICT_OK, true, 31);
  Add(6, Verdict::VERDICT_OK, true, 31);
  const auto volume = AddVolume(31);
  AddVolume(15);
  EXPECT_THAT(Deleted(), ElementsAre(bad, volume, nth));
}

TEST_F(RetentionTest, ExactlyAtTheEndOfItsTimeItStays) {
  AddVolume(30);
  AddVolume(15);
  EXPECT_THAT(Deleted(), IsEmpty());
}

TEST_F(RetentionTest, BeyondTheQuotaOkPartsGoFirstThenTheOldestOthers) {
  const auto bad = Add(1, Verdict::VERDICT_NOT_OK);
  Add(2, Verdict::VERDICT_NOT_OK);
  const auto nth = Add(4, Verdict::VERDICT_OK);
  Add(5, Verdict::VERDICT_OK);
  Add(6, Verdict::VERDICT_OK);
  rules_.quota_bytes = 3 * kBytes;
  EXPECT_THAT(Deleted(), ElementsAre(nth, bad));
}

TEST_F(RetentionTest, AQuotaThatCannotBeHeldIsSaid) {
  Add(5, Verdict::VERDICT_OK);
  Add(6, Verdict::VERDICT_OK);
  files_.push_back({"/r/parts/" + NameOf({kNowUs, 7, 0, false, false}), kBytes, true});
  rules_.quota_bytes = kBytes;
  const RetentionPlan plan = Plan();
  EXPECT_THAT(plan.deletions, IsEmpty());
  EXPECT_EQ(plan.bytes_over_quota, 2 * kBytes);
}

TEST_F(RetentionTest, AnOpenFileNeverGoesOneLeftBehindDoes) {
  const std::string old = "/r/parts/" + NameOf({kNowUs - 40 * kDayUs, 7, 0, false, false});
  AddVolume(15);
  files_.push_back({old, kBytes, true});
  EXPECT_THAT(Deleted(), IsEmpty());
  files_.back().open = false;
  EXPECT_THAT(Deleted(), ElementsAre(old));
}

TEST_F(RetentionTest, FilesOfOthersAreLeftAlone) {
  files_ = {{"/r/parts/notes.txt", 1'000'000'000, false},
            {"/r/parts/20200101T000000.000000Z_part000001_OK.lcmlog.gz", 1'000'000'000, false}};
  const RetentionPlan plan = Plan();
  EXPECT_THAT(plan.deletions, IsEmpty());
  EXPECT_EQ(plan.bytes_over_quota, 0);
}

TEST_F(RetentionTest, EveryDeletionHasItsReason) {
  Add(1, Verdict::VERDICT_NOT_OK, true, 31);
  AddVolume(15);
  for (int part = 5; part <= 7; ++part) {
    Add(part, Verdict::VERDICT_OK);
  }
  const auto plan = Plan();
  ASSERT_EQ(plan.deletions.size(), 2u);
  EXPECT_THAT(plan.deletions[0].reason, HasSubstr("30 days"));
  EXPECT_THAT(plan.deletions[1].reason, HasSubstr("not one of the newest 2"));
}

TEST_F(RetentionTest, ARecordingUnderAClockNobodyHadSetIsOfUnknownAge) {
  const std::int64_t year_2000_us = 946'684'800'000'000;
  files_.push_back({"/r/parts/" + NameOf({year_2000_us, 7, Verdict::VERDICT_NOT_OK, true, true}), kBytes,
                    false, year_2000_us + kDayUs});
  AddVolume(45);
  AddVolume(20);
  EXPECT_THAT(Deleted(), ElementsAre(files_[1].path));
}

TEST_F(RetentionTest, TheLastChangeCountsWhenItIsLaterThanTheName) {
  AddVolume(31);
  AddVolume(15);
  files_[0].changed_us = kNowUs - kDayUs;
  EXPECT_THAT(Deleted(), IsEmpty());
}

TEST_F(RetentionTest, AClockThatIsTooFarAheadDeletesNothingByAgeAndItIsSaid) {
  Add(1, Verdict::VERDICT_NOT_OK, true, 410);
  AddVolume(400);
  AddVolume(0.1);  // recorded with the wrong clock
  files_.push_back({"/r/station/" + NameOf({kNowUs, std::nullopt, 0, false, false}), kBytes, true});
  EXPECT_THAT(Deleted(), IsEmpty());
  EXPECT_THAT(Plan().doubt, HasSubstr("399 days"));
}

TEST_F(RetentionTest, AfterARealPauseAgeCountsAgainAsSoonAsRecordingHasGoneOnForLongEnough) {
  Add(1, Verdict::VERDICT_NOT_OK, true, 100);
  AddVolume(29);
  AddVolume(15);
  EXPECT_THAT(Deleted(), IsEmpty());
  AddVolume(30.5);
  EXPECT_THAT(Deleted(), ElementsAre(files_[0].path, files_[3].path));
  EXPECT_EQ(Plan().doubt, "");
}

TEST_F(RetentionTest, ALeftOverThatChangedToday) {
  files_.push_back({"/r/parts/" + NameOf({kNowUs, 7, 0, false, false}), kBytes, false, kNowUs - kDayUs / 2});
  rules_.quota_bytes = 1;
  EXPECT_THAT(Deleted(), IsEmpty()) << "somebody may still be at it";
  files_[0].changed_us = kNowUs - 2 * kDayUs;
  EXPECT_EQ(Deleted().size(), 1u);
}

TEST_F(RetentionTest, RecordingsOfTheFutureTakeNoPlaceAmongTheNewest) {
  for (int part = 41; part <= 43; ++part) {
    Add(part, Verdict::VERDICT_OK, true, -3650);
  }
  const auto old = Add(5, Verdict::VERDICT_OK);
  Add(6, Verdict::VERDICT_OK);
  Add(7, Verdict::VERDICT_OK);
  EXPECT_THAT(Deleted(), ElementsAre(old)) << "two are kept";
  rules_.quota_bytes = 5 * kBytes;
  EXPECT_EQ(Deleted().size(), 1u);
  rules_.quota_bytes = 4 * kBytes;
  EXPECT_EQ(Deleted().size(), 2u) << "beyond the quota they go";
}

TEST_F(RetentionTest, ADiskWithTooLittleSpaceIsGivenThatOfTheOldestOkParts) {
  Add(1, Verdict::VERDICT_NOT_OK);
  const auto nth = Add(4, Verdict::VERDICT_OK);
  Add(5, Verdict::VERDICT_OK);
  Add(6, Verdict::VERDICT_OK);
  for (StoredRecording& file : files_) {
    file.disk = 1;
  }
  AddVolume(10);  // on another disk
  rules_.min_free_bytes = 5 * kBytes;
  EXPECT_THAT(Deleted({{0, 5 * kBytes}, {1, 5 * kBytes}}), IsEmpty());
  EXPECT_THAT(Deleted({{0, 5 * kBytes}, {1, 4 * kBytes}}), ElementsAre(nth));
  EXPECT_THAT(Deleted({{0, 5 * kBytes}, {1, 3 * kBytes}}), IsEmpty()) << "one part is not enough: in vain";
}

}  // namespace
}  // namespace forgescan
