#include "services/recorder/recording_name.h"

#include <gtest/gtest.h>

#include "services/recorder/gaps.h"

namespace forgescan {
namespace {

constexpr std::int64_t kTimeUs = 1'795'356'907'123'456;  // 2026-11-22 14:15:07.123456 UTC

TEST(RecordingName, SaysTimePartVerdictAndWhetherItIsWhole) {
  EXPECT_EQ(NameOf({kTimeUs, 42, 1, true, true}), "20261122T141507.123456Z_part000042_OK.lcmlog");
  EXPECT_EQ(NameOf({kTimeUs, 42, 2, false, true}),
            "20261122T141507.123456Z_part000042_NOT_OK_INCOMPLETE.lcmlog");
  EXPECT_EQ(NameOf({kTimeUs, 42, 0, false, false}), "20261122T141507.123456Z_part000042.lcmlog.part");
  EXPECT_EQ(NameOf({kTimeUs, std::nullopt, 0, true, true}), "20261122T141507.123456Z.lcmlog");
  EXPECT_EQ(NameOf({kTimeUs, 42, 77, true, true}), "20261122T141507.123456Z_part000042_NO_VERDICT.lcmlog");
}

TEST(RecordingName, IsReadBack) {
  for (std::int8_t verdict = 0; verdict <= 4; ++verdict) {
    for (const bool complete : {true, false}) {
      for (const std::int32_t part : {1, 999'999, 1'000'000, INT32_MAX}) {
        const auto name = ParseRecordingName(NameOf({kTimeUs, part, verdict, complete, true}));
        ASSERT_TRUE(name.has_value());
        EXPECT_EQ(name->utime, kTimeUs);
        EXPECT_EQ(name->part, part);
        EXPECT_EQ(name->verdict, verdict);
        EXPECT_EQ(name->complete, complete);
        EXPECT_TRUE(name->closed);
      }
    }
  }
  const auto open = ParseRecordingName(NameOf({kTimeUs, 42, 0, false, false}));
  ASSERT_TRUE(open.has_value());
  EXPECT_FALSE(open->closed);
  EXPECT_FALSE(open->complete);
  const auto station = ParseRecordingName("20261122T141507.123456Z.lcmlog");
  ASSERT_TRUE(station.has_value());
  EXPECT_FALSE(station->part.has_value());
}

TEST(RecordingName, SortsByTime) {
  EXPECT_LT(NameOf({kTimeUs, 999, 1, true, true}), NameOf({kTimeUs + 1, 1, 1, true, true}));
  EXPECT_LT(NameOf({kTimeUs, 1, 1, true, true}), NameOf({kTimeUs + 86'400'000'000, 1, 1, true, true}));
}

TEST(RecordingName, OtherFilesAreNone) {
  for (const char* name :
       {"", ".part", ".lcmlog", "notes.txt", "20261122T141507.123456Z.lcmlog.gz",
        "x20261122T141507.123456Z.lcmlog", "20261322T141507.123456Z.lcmlog", "20261122T241507.123456Z.lcmlog",
        "20261122T141507.12345-Z.lcmlog", "20261122T141507.123456Z_part000042.lcmlog",
        "20261122T141507.123456Z_part000042_OK.lcmlog.part", "20261122T141507.123456Z_part42_OK.lcmlog",
        "20261122T141507.123456Z_part000000_OK.lcmlog", "20261122T141507.123456Z_part-00042_OK.lcmlog",
        "20261122T141507.123456Z_part000042_FINE.lcmlog",
        "20261122T141507.123456Z_part000042_OK_INCOMPLETE_INCOMPLETE.lcmlog",
        "20261122T141507.123456Z_part9999999999_OK.lcmlog", "20261122T141507.123456Z_station.lcmlog"}) {
    EXPECT_FALSE(ParseRecordingName(name).has_value()) << name;
  }
}

fsmsg::recording_gap_t Numbered(std::int64_t session, std::int64_t first, std::int64_t last) {
  auto gap = GapOf("A", "lost");
  gap.session = session;
  gap.first_sequence = first;
  gap.last_sequence = last;
  return gap;
}

TEST(Gaps, NeighboursBecomeOne) {
  std::vector<fsmsg::recording_gap_t> gaps;
  AddGap(gaps, Numbered(1, 5, 6));
  AddGap(gaps, Numbered(1, 7, 7));
  AddGap(gaps, Numbered(1, 9, 9));
  AddGap(gaps, Numbered(2, 10, 10));
  AddGap(gaps, GapOf("A", "lost"));
  AddGap(gaps, GapOf("A", "lost"));
  ASSERT_EQ(gaps.size(), 4u);
  EXPECT_EQ(gaps[0].first_sequence, 5);
  EXPECT_EQ(gaps[0].last_sequence, 7);
  EXPECT_EQ(gaps[1].first_sequence, 9);
  EXPECT_EQ(gaps[3].last_sequence, 0);
}

}  // namespace
}  // namespace forgescan
