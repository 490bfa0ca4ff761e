// The ball bar of many stations: its certificate and its noise are those of the one station with images.
#include "tools/forgescan/experiment/bar_stations.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/forgescan/experiment/bar_refinement.h"

namespace forgescan {
namespace {

constexpr int kStations = 30;

CellConfig Cell(int scale_divisor) {
  return *LoadCellConfig(FORGESCAN_SOURCE_DIR "/stations/virtual/cell.toml", scale_divisor);
}

TEST(BarStations, EveryStationHasACertificateOfItsOwn) {
  CellConfig config = Cell(1);
  double sum_of_squares = 0;
  for (int seed = 1; seed <= kStations; ++seed) {
    config.seed = static_cast<std::uint64_t>(seed);
    const CertifiedBar certified = Certified(config);
    const double error = (certified.bar.distance_mm - certified.true_distance_mm) / (0.5 * kCertifiedMm);
    EXPECT_NE(error, 0);
    sum_of_squares += error * error;
  }
  EXPECT_NEAR(sum_of_squares / kStations, 1, 4 * std::sqrt(2.0 / kStations));  // 4 sigma of the mean square
}

TEST(BarStations, SmallerImagesMeasureTheBarWorse) {
  EXPECT_EQ(CenterSigmaMm(Cell(1)), kFullCenterSigmaMm);
  EXPECT_DOUBLE_EQ(CenterSigmaMm(Cell(4)), 4 * kFullCenterSigmaMm);
  constexpr double kLimitMm = 0.003;
  const BarStations full = RefineStations(BallCell(Cell(1)), kStations, kLimitMm);
  const BarStations quarter = RefineStations(BallCell(Cell(4)), kStations, kLimitMm);
  EXPECT_LT(quarter.within_after, full.within_after - 0.2);
  EXPECT_GT(full.within_after, full.within_before);
}

}  // namespace
}  // namespace forgescan
