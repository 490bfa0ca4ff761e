#include "services/reconstruction/pattern_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace forgescan {
namespace {

using ::testing::HasSubstr;

constexpr char kGood[] = R"(
projector_width_px = 1280
background = "shared"
reference = "white.png"
[[frequency]]
period_px = 20
frames = ["1.png", "2.png", "3.png"]
shifts_deg = [0, 90, 180]
[[frequency]]
period_px = 20.5
frames = ["4.png", "5.png"]
shifts_deg = [0, 90]
)";

std::string Replaced(const std::string& from, const std::string& to) {
  std::string text = kGood;
  text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(PatternSet, Starts) {
  const auto pattern = ParsePatternSet(kGood, "pattern.toml");
  ASSERT_TRUE(pattern.ok()) << pattern.error().message;
  EXPECT_EQ(pattern->frame_count(), 6);
  EXPECT_EQ(pattern->reference_frame_index, 5);
  EXPECT_EQ(pattern->frequencies[1].frame_index, (std::vector<int>{3, 4}));
  EXPECT_DOUBLE_EQ(pattern->frequencies[1].period_px, 20.5);
}

TEST(PatternSet, EveryWrongEntryIsNamed) {
  const std::vector<std::array<std::string, 3>> cases = {
      {"background = \"shared\"", "background = \"some\"", "background is \"some\""},
      {"background = \"shared\"", "background = \"own\"", "frequency 2: it has 2 frames"},
      {"background = \"shared\"", "", "background is missing"},
      {"background = \"shared\"", "backround = \"own\"", "backround is unknown"},
      {"projector_width_px = 1280", "projector_width_px = -3", "projector_width_px is -3"},
      {"projector_width_px = 1280", "projector_width_px = \"wide\"",
       "projector_width_px is missing or not a whole number"},
      {"projector_width_px = 1280", "projector_width_px = 12e80",
       "projector_width_px is missing or not a whole number"},
      {"period_px = 20.5", "period_px = nan", "frequency 2: period_px is nan"},
      {"period_px = 20.5", "period = 20.5", "frequency 2: the key period is unknown"},
      {"shifts_deg = [0, 90]", "shifts_deg = [0, 90, 180]", "2 frames but 3 shifts_deg"},
      {"shifts_deg = [0, 90]", "shifts_deg = [0, inf]", "a shift is inf"},
      {"shifts_deg = [0, 90]", "shifts_deg = [0, \"x\"]", "entry 2 of shifts_deg"},
      {"reference = \"white.png\"", "reference_light = \"white\"", "reference is missing"},
      {"reference = \"white.png\"", "reference = \"w.png\"\nreference_light = \"grey\"",
       "reference_light is \"grey\""},
      {"\"5.png\"", "\"1.png\"", "each must be used exactly once"},
      {"[[frequency]]", "[[frequency]", "line"},
  };
  for (const auto& [from, to, sentence] : cases) {
    const auto pattern = ParsePatternSet(Replaced(from, to), "pattern.toml");
    ASSERT_FALSE(pattern.ok()) << to;
    EXPECT_THAT(pattern.error().message, HasSubstr(sentence));
    EXPECT_THAT(pattern.error().message, HasSubstr("pattern.toml"));
  }
  EXPECT_EQ(LoadPatternSet("/nonexistent.toml").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace forgescan
