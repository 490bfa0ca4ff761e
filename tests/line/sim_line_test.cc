#include "tests/line/sim_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/services/recorder/recordings.h"

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::RenderedCell;
using testing::SimLine;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr auto kOk = fsmsg::verdict_t::VERDICT_OK;
constexpr auto kNotOk = fsmsg::verdict_t::VERDICT_NOT_OK;
constexpr auto kNotDecidable = fsmsg::verdict_t::VERDICT_NOT_DECIDABLE;
constexpr auto kNotInspected = fsmsg::verdict_t::VERDICT_NOT_INSPECTED;

// mm. Two parts came out within 0.06; the taught views alone stand for up to 0.08 (3 sigma, station_test),
// and a pixel covers 0.87 instead of 0.22, which leaves a tenth of the points for each face.
constexpr double kSizeToleranceMm = 0.15;

std::unique_ptr<SimLine> MakeLine(RenderedCell& cell, int parts, int first_part = 1) {
  auto line = SimLine::Create(cell, parts, first_part);
  EXPECT_TRUE(line.ok()) << line.error().message;
  return line.ok() ? std::move(*line) : nullptr;
}

class SimLineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto cell = RenderedCell::Create();
    ASSERT_TRUE(cell.ok()) << cell.error().message;
    cell_ = std::move(*cell);
  }
  static void TearDownTestSuite() { cell_.reset(); }

  static void ExpectTrueSizes(const fsmsg::verdict_t& verdict) {
    const auto truth = cell_->TrueSizesMm(verdict.part);
    ASSERT_TRUE(truth.ok()) << truth.error().message;
    ASSERT_EQ(verdict.dimensions.size(), truth->size());
    for (const fsmsg::dimension_t& dimension : verdict.dimensions) {
      EXPECT_NEAR(dimension.measured_mm, truth->at(dimension.name), kSizeToleranceMm) << dimension.name;
      RecordProperty(
          dimension.name + "_error_um",
          static_cast<int>(std::lround(1000 * (dimension.measured_mm - truth->at(dimension.name)))));
    }
  }
  // The part has one verdict, the line has heard it, and no size is claimed for what was not inspected.
  static void ExpectSorted(const SimLine& line, int part, int verdict) {
    ASSERT_FALSE(line.verdicts().empty());
    const auto index = static_cast<std::size_t>(part - line.verdicts().front().part);
    ASSERT_GT(line.verdicts().size(), index);
    EXPECT_EQ(line.verdicts()[index].part, part);
    EXPECT_EQ(line.verdicts()[index].verdict, verdict) << line.verdicts()[index].reason;
    ASSERT_GT(line.sorted().size(), index);
    EXPECT_EQ(line.sorted()[index].part, part);
    EXPECT_EQ(line.sorted()[index].verdict, verdict);
    EXPECT_EQ(line.sorted()[index].acknowledged, 1) << line.sorted()[index].reason;
    ASSERT_GT(line.commands().size(), index);
    EXPECT_EQ(line.commands()[index].part, static_cast<std::uint32_t>(part));
    EXPECT_EQ(static_cast<int>(line.commands()[index].verdict), verdict);
    if (verdict == kNotInspected) {
      for (const fsmsg::dimension_t& dimension : line.verdicts()[index].dimensions) {
        EXPECT_TRUE(std::isnan(dimension.measured_mm)) << dimension.name;
      }
    }
  }

  // The part has one recording, which holds its images and its verdict and lacks nothing. Ends the line's
  // recording.
  static void ExpectRecorded(SimLine& line, int part, int verdict) {
    const auto parts = testing::OfPart(testing::ReadRecordings(line.StopRecording()), part);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].name.verdict, verdict);
    ASSERT_TRUE(parts[0].closed.has_value());
    for (const fsmsg::recording_gap_t& gap : parts[0].closed->gaps) {
      ADD_FAILURE() << gap.channel << ": " << gap.reason;
    }
    const auto views = static_cast<std::size_t>(cell_->view_count());
    EXPECT_EQ(parts[0].On("FRAME_LEFT").size(), 8 * views);
    EXPECT_EQ(parts[0].On("FRAME_RIGHT").size(), 8 * views);
    EXPECT_EQ(parts[0].On("VIEW_RESULT").size(), views);
    EXPECT_EQ(parts[0].On("VERDICT").size(), 1u);
    EXPECT_EQ(parts[0].On("RECORDED_FILE").size(), 6u);
    EXPECT_GT(parts[0].On("COOLING_STATE").size(), 0u);
  }

  // What the truth makes of a size: a verdict where it is farther than 2 U from both limits, so that no
  // measurement within U of it can say otherwise; nearer, none is right or wrong.
  static void ExpectVerdictsAsTheTruth(const fsmsg::verdict_t& verdict) {
    const auto truth = cell_->TrueSizesMm(verdict.part);
    ASSERT_TRUE(truth.ok()) << truth.error().message;
    for (const fsmsg::dimension_t& dimension : verdict.dimensions) {
      const double size_mm = truth->at(dimension.name);
      const double inside_mm = std::min(size_mm - dimension.lower_mm, dimension.upper_mm - size_mm);
      EXPECT_LT(std::abs(dimension.measured_mm - size_mm), dimension.uncertainty_mm) << dimension.name;
      if (std::abs(inside_mm) > 2 * dimension.uncertainty_mm) {
        EXPECT_EQ(dimension.verdict, inside_mm > 0 ? kOk : kNotOk)
            << "part " << verdict.part << ": " << dimension.name;
      }
    }
  }
  static int VerdictOf(const fsmsg::verdict_t& verdict, const std::string& name) {
    const auto found = std::find_if(verdict.dimensions.begin(), verdict.dimensions.end(),
                                    [&](const auto& dimension) { return dimension.name == name; });
    return found != verdict.dimensions.end() ? found->verdict : fsmsg::verdict_t::VERDICT_UNKNOWN;
  }

  // What one undisturbed part gives; the other tests are held against it.
  struct Outcome {
    std::vector<Bytes> published;
    std::vector<fsmsg::dimension_t> dimensions;
  };
  static const Outcome& Nominal() {
    static const Outcome outcome = [] {
      const auto line = MakeLine(*cell_, 1);
      EXPECT_TRUE(line->RunUntilSorted(1));
      line->RunFor(10 * kSecondUs);
      return Outcome{line->published(), line->verdicts().at(0).dimensions};
    }();
    return outcome;
  }

  static std::unique_ptr<RenderedCell> cell_;
};
std::unique_ptr<RenderedCell> SimLineTest::cell_;

TEST_F(SimLineTest, Starts) {
  const auto line = MakeLine(*cell_, 1);
  ASSERT_NE(line, nullptr);
  line->RunFor(kSecondUs / 2);
  EXPECT_EQ(line->Total("errors"), 0);
}

TEST_F(SimLineTest, MeasuresAndSortsAPart) {
  const auto line = MakeLine(*cell_, 1);
  ASSERT_NE(line, nullptr);
  ASSERT_TRUE(line->RunUntilSorted(1));
  line->RunFor(10 * kSecondUs);
  EXPECT_EQ(line->verdicts().size(), 1u);
  ExpectSorted(*line, 1, kOk);
  ExpectTrueSizes(line->verdicts().at(0));
  EXPECT_EQ(line->StreamTotals().missing, 0);
  EXPECT_EQ(line->Total("frames_missing"), 0);
  EXPECT_EQ(line->Total("errors"), 0);
  EXPECT_EQ(line->published(), Nominal().published);
  ExpectRecorded(*line, 1, kOk);
}

// Parts 6 and 7 of stations/virtual/cell.toml are too short, and nearer to a limit than can be measured.
TEST_F(SimLineTest, SortsByTheTruthAndNamesTheSizeThatIsWrong) {
  const auto line = MakeLine(*cell_, 3, 6);
  ASSERT_NE(line, nullptr);
  ASSERT_TRUE(line->RunUntilSorted(3));
  ASSERT_EQ(line->verdicts().size(), 3u);
  ExpectSorted(*line, 6, kNotOk);
  ExpectSorted(*line, 7, kNotDecidable);
  ExpectSorted(*line, 8, kOk);
  for (const fsmsg::verdict_t& verdict : line->verdicts()) {
    ExpectTrueSizes(verdict);
    ExpectVerdictsAsTheTruth(verdict);
    const int length = verdict.part == 6 ? kNotOk : kOk;
    const int diameter = verdict.part == 7 ? kNotDecidable : kOk;
    EXPECT_EQ(VerdictOf(verdict, "total_length"), length) << verdict.part;
    EXPECT_EQ(VerdictOf(verdict, "right_cylinder_diameter"), diameter) << verdict.part;
    EXPECT_EQ(VerdictOf(verdict, "left_plate_width"), kOk) << verdict.part;
    EXPECT_EQ(VerdictOf(verdict, "right_plate_width"), kOk) << verdict.part;
    EXPECT_EQ(VerdictOf(verdict, "left_cylinder_diameter"), kOk) << verdict.part;
  }
}

TEST_F(SimLineTest, ABusThatLosesATenthChangesNoSize) {
  const auto line = MakeLine(*cell_, 1);
  ASSERT_NE(line, nullptr);
  line->SetBusFaults({.loss = 0.1, .large_loss = 0.1, .duplicate = 0.05, .jitter_us = 2'000});
  ASSERT_TRUE(line->RunUntilSorted(1));
  line->RunFor(10 * kSecondUs);
  EXPECT_EQ(line->verdicts().size(), 1u);
  ExpectSorted(*line, 1, kOk);
  EXPECT_GT(line->StreamTotals().recovered, 0);
  EXPECT_EQ(line->StreamTotals().missing, 0);
  const auto& measured = line->verdicts().at(0).dimensions;
  ASSERT_EQ(measured.size(), Nominal().dimensions.size());
  for (std::size_t i = 0; i < measured.size(); ++i) {
    // mm: the mean of equal pyrometer readings rounds differently for another number of them.
    EXPECT_NEAR(measured[i].measured_mm, Nominal().dimensions[i].measured_mm, 1e-6) << measured[i].name;
  }
  ExpectRecorded(*line, 1, kOk);
}

TEST_F(SimLineTest, ALostFrameVoidsItsPartAndTheNextIsGood) {
  const auto line = MakeLine(*cell_, 2);
  ASSERT_NE(line, nullptr);
  line->LoseFrame({.part = 1, .view = 4, .pattern = 3, .right = true});
  ASSERT_TRUE(line->RunUntilSorted(2));
  EXPECT_EQ(line->verdicts().size(), 2u);
  ExpectSorted(*line, 1, kNotInspected);
  // 8 patterns a view: the fourth pulse of view 4 is the 36th of its camera.
  EXPECT_THAT(line->verdicts().at(0).reason, AllOf(HasSubstr("view 4"), HasSubstr("pulse 36")));
  ExpectSorted(*line, 2, kOk);
  ExpectTrueSizes(line->verdicts().at(1));
  EXPECT_EQ(line->Total("frames_missing"), 1);
}

TEST_F(SimLineTest, AProtectiveStopEndsThePartWithItsReason) {
  const auto line = MakeLine(*cell_, 1);
  ASSERT_NE(line, nullptr);
  ASSERT_TRUE(line->RunUntilViews(3));
  line->robot().SetFaults({.protective_stop = true});
  ASSERT_TRUE(line->RunUntilSorted(1));
  ASSERT_EQ(line->scans().size(), 1u);
  EXPECT_EQ(line->scans()[0].status, fsmsg::scan_complete_t::STATUS_ABORTED);
  EXPECT_EQ(line->scans()[0].views_captured, 3);
  EXPECT_EQ(line->verdicts().size(), 1u);
  ExpectSorted(*line, 1, kNotInspected);
  EXPECT_THAT(line->verdicts().at(0).reason, AllOf(HasSubstr("view 3"), HasSubstr("robot")));
}

TEST_F(SimLineTest, OverTemperatureStopsTheInspection) {
  const auto line = MakeLine(*cell_, 1);
  ASSERT_NE(line, nullptr);
  ASSERT_TRUE(line->RunUntilViews(2));
  line->cooling().SetHeatLoad(50'000);  // W, 25 K/s
  line->cooling().SetAmbient(41);       // degC, so that a stuck sensor is not the reason
  ASSERT_TRUE(line->RunUntilSorted(1));
  ASSERT_EQ(line->scans().size(), 1u);
  EXPECT_THAT(line->scans()[0].reason, HasSubstr("cooling interlock"));
  EXPECT_EQ(line->verdicts().size(), 1u);
  ExpectSorted(*line, 1, kNotInspected);
  EXPECT_THAT(line->verdicts().at(0).reason, HasSubstr("cooling interlock"));
}

}  // namespace
}  // namespace forgescan
