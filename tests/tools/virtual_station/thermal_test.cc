#include "tools/virtual_station/thermal.h"

#include <gtest/gtest.h>

#include <limits>

namespace forgescan {
namespace {

TEST(Thermal, StrainOfTheSteelTable) {
  const double rows[][2] = {{400, 0.00520}, {600, 0.00840},  {700, 0.01012},  {800, 0.01100},
                            {900, 0.01180}, {1000, 0.01380}, {1100, 0.01580}, {1200, 0.01780}};
  for (const auto& row : rows) {
    EXPECT_NEAR(*ThermalStrain(row[0]), row[1], 5e-6) << row[0];  // the table has five decimals
  }
}

TEST(Thermal, AxleShrinksTo20Degrees) {
  EXPECT_NEAR(1888.46 * *SizeScale(20.0, 900.0), 1866.44, 0.005);  // mm: printed digits
}

TEST(Thermal, BarsCoolAsFastAsTheirSizeLets) {
  CoolingLaw law;
  const double rows[][3] = {{50, 900, 1.6}, {90, 900, 0.90}, {120, 900, 0.67}, {90, 1100, 1.6}};
  for (const auto& row : rows) {
    law.bar_diameter_mm = row[0];
    EXPECT_NEAR(*CoolingRate(law, row[1]), -row[2], 0.05) << row[0];  // K/s: two printed digits
  }
}

TEST(Thermal, CoolsOverAScan) {
  const CoolingLaw law;
  EXPECT_NEAR(925.0 - *TemperatureAfter(law, 925.0, 27.0), 25.0, 1.0);  // K: 0.90 to 0.97 K/s for 27 s
  EXPECT_DOUBLE_EQ(*TemperatureAfter(law, 925.0, 0.0), 925.0);
  EXPECT_NEAR(*TemperatureAfter(law, *TemperatureAfter(law, 925.0, 10.0), 17.0),
              *TemperatureAfter(law, 925.0, 27.0),
              1e-6);  // K: truncation of the integrator
}

TEST(Thermal, RefusesWhatTheTablesDoNotHold) {
  EXPECT_FALSE(ThermalStrain(1201.0).ok());
  EXPECT_FALSE(SpecificHeat(std::numeric_limits<double>::quiet_NaN()).ok());
  EXPECT_FALSE(TemperatureAfter({}, 900.0, -1.0).ok());
}

}  // namespace
}  // namespace forgescan
