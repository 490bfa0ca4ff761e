#include "tools/forgescan/replay/what_if.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace forgescan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
constexpr auto kOk = fsmsg::verdict_t::VERDICT_OK;
constexpr auto kNotOk = fsmsg::verdict_t::VERDICT_NOT_OK;
constexpr auto kNone = fsmsg::verdict_t::VERDICT_UNKNOWN;

fsmsg::verdict_t Verdict(int part, std::int8_t verdict, double length_mm) {
  fsmsg::verdict_t message{};
  message.utime = 1000 + part;
  message.part = part;
  message.verdict = verdict;
  message.reason = verdict == kOk ? "" : "length <too> large";
  fsmsg::dimension_t length{};
  length.name = "length";
  length.measured_mm = length_mm;
  length.lower_mm = 9;
  length.upper_mm = 11;
  length.verdict = verdict;
  message.dimensions = {length};
  message.dimension_count = 1;
  return message;
}

TEST(WhatIf, FindsTheVerdictsThatChange) {
  const auto parts = CompareVerdicts({Verdict(1, kOk, 10), Verdict(2, kOk, 10.9)},
                                     {Verdict(2, kNotOk, 11.2), Verdict(1, kOk, 10.001)});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_FALSE(parts[0].Flipped());
  EXPECT_FALSE(parts[0].dimensions[0].Flipped());
  EXPECT_TRUE(parts[1].Flipped());
  EXPECT_TRUE(parts[1].dimensions[0].Flipped());
  EXPECT_DOUBLE_EQ(parts[1].dimensions[0].recorded_mm, 10.9);
  EXPECT_DOUBLE_EQ(parts[1].dimensions[0].now_mm, 11.2);
  const std::string text = WhatIfText(parts);
  EXPECT_THAT(text, HasSubstr("part 2: OK -> NOT_OK (length <too> large)\n"));
  EXPECT_THAT(text, HasSubstr("1 of 2 verdicts change\n"));
  EXPECT_THAT(text, HasSubstr("length: largest change +0.3000 mm (part 2), 1 verdicts change\n"));
}

TEST(WhatIf, APartWithoutAVerdictOnOneSideIsAChange) {
  const auto parts = CompareVerdicts({Verdict(1, kOk, 10)}, {Verdict(2, kOk, 10)});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].now_verdict, kNone);
  EXPECT_EQ(parts[1].recorded_verdict, kNone);
  EXPECT_TRUE(parts[0].Flipped() && parts[1].Flipped());
  EXPECT_TRUE(std::isnan(parts[0].dimensions[0].now_mm));
  EXPECT_TRUE(std::isnan(parts[1].dimensions[0].recorded_mm));
}

TEST(WhatIf, TheSameNumberAtAnotherTimeIsAnotherPart) {
  auto again = Verdict(1, kOk, 10);
  again.utime += 50;
  EXPECT_EQ(CompareVerdicts({Verdict(1, kOk, 10)}, {again}).size(), 2u);
}

TEST(WhatIf, AVerdictSaidAgainIsOneVerdict) {
  const auto parts = CompareVerdicts({Verdict(1, kOk, 10), Verdict(1, kOk, 10)},
                                     {Verdict(1, kOk, 10), Verdict(1, kOk, 10), Verdict(1, kOk, 10)});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].dimensions.size(), 1u);
  EXPECT_FALSE(parts[0].Flipped() || parts[0].dimensions[0].Flipped());
}

TEST(WhatIf, ThePageShowsEveryPartAndEscapesWhatItIsTold) {
  const auto parts = CompareVerdicts({Verdict(1, kOk, 10)}, {Verdict(1, kNotOk, 11.25)});
  const std::string page =
      WhatIfHtml({"<east>", {"a&b.lcmlog"}, {"fusion.x = 1"}, {"an end is missing"}}, parts);
  for (const char* text : {"&lt;east&gt;", "an end is missing", "a&amp;b.lcmlog", "fusion.x = 1", "11.250",
                           "length &lt;too&gt; large", "1 of 1 verdicts change"}) {
    EXPECT_THAT(page, HasSubstr(text));
  }
  EXPECT_THAT(page, Not(HasSubstr("<east>")));
}

TEST(WhatIf, ASizeThatIsNotDeterminedAnyMoreIsAChange) {
  const std::string text =
      WhatIfText(CompareVerdicts({Verdict(1, kOk, 10)}, {Verdict(1, kNone, std::nan(""))}));
  EXPECT_THAT(text, HasSubstr("length: 1 sizes are not determined any more, 1 verdicts change\n"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace forgescan
