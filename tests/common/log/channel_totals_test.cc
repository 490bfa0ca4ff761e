#include "services/common/log/channel_totals.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

namespace forgescan {
namespace {

const Bytes kFirst{1, 2, 3}, kSecond{4, 5};

TEST(ChannelTotals, Starts) { EXPECT_TRUE(ChannelTotals().Totals().empty()); }

TEST(ChannelTotals, CountsByChannelInOrderOfName) {
  ChannelTotals totals;
  totals.Add("B", kFirst);
  totals.Add("A", kSecond);
  totals.Add("B", kSecond);
  const auto all = totals.Totals();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].channel, "A");
  EXPECT_EQ(all[1].channel, "B");
  EXPECT_EQ(all[1].events, 2);
  EXPECT_EQ(all[1].bytes, 5);
}

TEST(ChannelTotals, TheCrcIsThatOfAllMessagesOneAfterTheOther) {
  ChannelTotals totals;
  totals.Add("A", kFirst);
  totals.Add("A", {});
  totals.Add("A", kSecond);
  const Bytes joined{1, 2, 3, 4, 5};
  EXPECT_EQ(static_cast<std::uint32_t>(totals.Totals()[0].crc32),
            libdeflate_crc32(0, joined.data(), joined.size()));
  EXPECT_EQ(totals.Totals()[0].events, 3);
}

TEST(ChannelTotals, AnEmptyMessageIsAnEvent) {
  ChannelTotals totals;
  totals.Add("A", {});
  EXPECT_EQ(totals.Totals()[0].events, 1);
  EXPECT_EQ(totals.Totals()[0].bytes, 0);
  EXPECT_EQ(totals.Totals()[0].crc32, 0);
}

}  // namespace
}  // namespace forgescan
