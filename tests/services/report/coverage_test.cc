// The intervals a size is stated with must hold the true size as often as they say.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/services/report/coverage_simulation.h"

namespace forgescan::testing {
namespace {

constexpr double kStated = 0.9545;  // k = 2

// Of `parts` independent intervals that hold the truth with this share each, the share that does is no
// farther off in all but one of 1000 runs (3.29 standard deviations of a binomial count).
double Reach(double share, int parts) { return 3.29 * std::sqrt(share * (1 - share) / parts); }

void ExpectCoverage(const std::vector<Coverage>& coverage, int parts) {
  for (const Coverage& c : coverage) {
    EXPECT_EQ(c.parts, parts) << c.name;
    EXPECT_GE(c.Share(), kStated - Reach(kStated, parts)) << c.name;
    // Beyond 1 for fewer than 227 parts: there the scatter against the stated tells of intervals too wide.
    EXPECT_LE(c.Share(), kStated + Reach(kStated, parts)) << c.name;
  }
}

TEST(CoverageTest, Starts) {
  CoverageOptions options;
  options.parts = 1;
  options.surface_points = 60'000;
  const auto coverage = SimulateCoverage(options);
  ASSERT_TRUE(coverage.ok()) << coverage.error().message;
  EXPECT_EQ(coverage->size(), 5U);
}

TEST(CoverageTest, IntervalsHoldTheTruthAsOftenAsStated) {
  CoverageOptions options;
  options.parts = 60;
  options.surface_points = 60'000;
  const auto coverage = SimulateCoverage(options);
  ASSERT_TRUE(coverage.ok()) << coverage.error().message;
  std::fputs(CoverageTable(*coverage).c_str(), stdout);
  ExpectCoverage(*coverage, options.parts);
  for (const Coverage& c : *coverage) {
    // A scatter from 60 parts is itself uncertain by 9 %; three of it.
    EXPECT_NEAR(c.scatter_mm / c.stated_mm, 1, 0.28) << c.name;
  }
}

// An error nobody stated shows: the test can fail.
TEST(CoverageTest, AnErrorThatIsNotStatedShows) {
  CoverageOptions options;
  options.parts = 20;
  options.surface_points = 60'000;
  const auto honest = SimulateCoverage(options);
  options.budget.refraction_mm *= 5;
  const auto rough = SimulateCoverage(options);
  ASSERT_TRUE(honest.ok() && rough.ok());
  for (std::size_t i = 1; i < honest->size(); ++i) {
    EXPECT_GT((*rough)[i].scatter_mm, 1.5 * (*honest)[i].stated_mm) << (*honest)[i].name;
  }
}

// The evaluation cannot know over what length errors go together: it takes `patch_cell_mm` and
// `form_cell_mm`. With half and three times those, 500 parts each: 93.6 to 96.6 % of every size, but 93.0
// and 93.6 % of the diameters with a form three times as long, whose 0.02 mm more nobody states: 1.83
// standard deviations, 93 %.
struct Lengths {
  double patch, form;
  double least_share;  // stated share, before chance
};
const Lengths kLengths[] = {{0.5, 1, kStated}, {3, 1, kStated}, {1, 0.5, kStated}, {1, 3, 0.93}};

Result<std::vector<Coverage>> RunLengths(const Lengths& lengths, CoverageOptions options) {
  options.patch_lengths = lengths.patch;
  options.form_lengths = lengths.form;
  std::printf("patches %.1f, form %.1f times as long as assumed\n", lengths.patch, lengths.form);
  auto coverage = SimulateCoverage(options);
  if (coverage.ok()) std::fputs(CoverageTable(*coverage).c_str(), stdout);
  return coverage;
}

void ExpectAtLeast(const std::vector<Coverage>& coverage, double share) {
  for (const Coverage& c : coverage) EXPECT_GE(c.Share(), share - Reach(share, c.parts)) << c.name;
}

TEST(CoverageTest, HoldsWhereErrorsGoTogetherOverOtherLengths) {
  CoverageOptions options;
  options.parts = 60;
  options.surface_points = 60'000;
  for (const Lengths& lengths : kLengths) {
    const auto coverage = RunLengths(lengths, options);
    ASSERT_TRUE(coverage.ok()) << coverage.error().message;
    ExpectAtLeast(*coverage, lengths.least_share);
  }
}

// Form alone: what is not seen of a cylinder is as uneven as what is, and its term is as large as the error.
TEST(CoverageTest, TheFormOfWhatIsNotSeenIsTakenForWhatItIs) {
  CoverageOptions options;
  options.budget = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  options.parts = 100;
  options.surface_points = 60'000;
  const auto coverage = SimulateCoverage(options);
  ASSERT_TRUE(coverage.ok()) << coverage.error().message;
  std::fputs(CoverageTable(*coverage).c_str(), stdout);
  for (const std::size_t diameter : {3U, 4U}) {
    // A scatter from 100 parts is uncertain by 7 %; three of it.
    EXPECT_NEAR((*coverage)[diameter].scatter_mm / (*coverage)[diameter].stated_mm, 1, 0.21);
  }
}

// The full runs, minutes each: --gtest_also_run_disabled_tests --gtest_filter=*Parts
// A count of 500 scatters by 0.93 % (one standard deviation): a size with exactly 95.45 % lies outside 93 to
// 97 % in one run of 19, one of five sizes in a quarter of all runs. Eight runs together scatter by 0.33 %.
TEST(CoverageTest, DISABLED_EightTimesFiveHundredParts) {
  std::vector<Coverage> sum(5);
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    CoverageOptions options;
    options.seed = seed;
    const auto coverage = SimulateCoverage(options);
    ASSERT_TRUE(coverage.ok()) << coverage.error().message;
    std::fputs(CoverageTable(*coverage).c_str(), stdout);
    ExpectCoverage(*coverage, options.parts);
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i].name = (*coverage)[i].name;
      sum[i].parts += (*coverage)[i].parts;
      sum[i].held += (*coverage)[i].held;
    }
  }
  for (const Coverage& c : sum) {
    std::printf("%-20s %d of %d, %.2f %%\n", c.name.c_str(), c.held, c.parts, 100 * c.Share());
    EXPECT_GE(c.Share(), 0.93) << c.name;
    EXPECT_LE(c.Share(), 0.97) << c.name;
  }
}

TEST(CoverageTest, DISABLED_OtherLengthsFiveHundredParts) {
  for (const Lengths& lengths : kLengths) {
    const auto coverage = RunLengths(lengths, {});
    ASSERT_TRUE(coverage.ok()) << coverage.error().message;
    ExpectAtLeast(*coverage, lengths.least_share);
  }
}

}  // namespace
}  // namespace forgescan::testing
