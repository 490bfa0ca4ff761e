// The intervals a size is stated with must hold the true size as often as they say.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/services/report/coverage_simulation.h"

namespace forgescan::testing {
namespace {

// Of `parts` independent intervals that hold the truth with 95.45 % each, this many at least and at most hold
// it in all but one of 1000 runs (3.29 standard deviations of a binomial count).
void ExpectCoverage(const std::vector<Coverage>& coverage, int parts) {
  const double share = 0.9545, reach = 3.29 * std::sqrt(share * (1 - share) / parts);
  for (const Coverage& c : coverage) {
    EXPECT_EQ(c.parts, parts) << c.name;
    EXPECT_GE(c.Share(), share - reach) << c.name;
    EXPECT_LE(c.Share(), std::min(1.0, share + reach)) << c.name;
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

void ExpectWithin(const CoverageOptions& options, double least, double most) {
  const auto coverage = SimulateCoverage(options);
  ASSERT_TRUE(coverage.ok()) << coverage.error().message;
  std::fputs(CoverageTable(*coverage).c_str(), stdout);
  for (const Coverage& c : *coverage) {
    EXPECT_GE(c.Share(), least) << c.name;
    EXPECT_LE(c.Share(), most) << c.name;
  }
}

// The full runs: --gtest_also_run_disabled_tests --gtest_filter=*Parts
// A count of 500 scatters by 0.93 % (one standard deviation): of five sizes with exactly 95.45 % each, one
// lies outside 93 to 97 % in a quarter of all runs. One of 1500 scatters by 0.54 % and tells better.
TEST(CoverageTest, DISABLED_FiveHundredParts) { ExpectWithin({}, 0.93, 0.97); }

TEST(CoverageTest, DISABLED_FifteenHundredParts) {
  CoverageOptions options;
  options.parts = 1500;
  options.seed = 2;
  ExpectWithin(options, 0.93, 0.97);
}

}  // namespace
}  // namespace forgescan::testing
