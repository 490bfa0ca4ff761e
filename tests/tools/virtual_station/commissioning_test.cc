// What commissioning measures: near the truth, as near as the cell's file says, and never the truth itself.
#include "tools/virtual_station/commissioning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "services/fusion/expansion.h"
#include "services/report/uncertainty.h"
#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

const std::string kStations = std::string(FORGESCAN_SOURCE_DIR) + "/stations/";
constexpr int kCells = 400;  // of other seeds: a standard deviation over them is known to 3.5 %

CellConfig Config() {
  auto config = LoadCellConfig(kStations + "virtual/cell.toml", 8);
  EXPECT_TRUE(config.ok());
  return *config;
}

CellConfig Perfect() {
  CellConfig config = Config();
  config.commissioning_error = {};
  return config;
}

std::string StationText(const std::string& name) {
  std::stringstream text;
  text << std::ifstream(kStations + name + "/station.toml").rdbuf();
  return text.str();
}

// Root mean square of `error(config)` over the cells.
template <typename Error>
double RmsOverCells(const Error& error) {
  CellConfig config = Config();
  double square = 0.0;
  for (int i = 0; i < kCells; ++i) {
    config.seed = static_cast<std::uint64_t>(i);
    const double value = error(config);
    square += value * value;
  }
  return std::sqrt(square / kCells);
}

TEST(Commissioning, WithoutErrorsGivesTheTruth) {
  const CellConfig config = Perfect();
  const auto expansion = MeasureExpansion(config);
  ASSERT_TRUE(expansion.ok());
  for (std::size_t i = 0; i < expansion->degc.size(); ++i) {
    EXPECT_DOUBLE_EQ(expansion->elongation[i], *ThermalStrain(expansion->degc[i]));
  }
  EXPECT_DOUBLE_EQ(MeasureNoise(config).gain_dn, config.sensor.gain_dn);
  EXPECT_NEAR(MeasureNoise(config).read_dn, std::hypot(config.sensor.read_noise_dn, 0.2887), 1e-4);  // DN
  const MeasuredPattern pattern = MeasurePattern(config, ProjectedSet::kReduced);
  ASSERT_EQ(pattern.modulation_ratio.size(), 3u);
  EXPECT_EQ(pattern.modulation_ratio[0], 1.0);
  // Blur takes more from narrower fringes: 63, 64, 56 of them, in the order of projection.
  EXPECT_LT(pattern.modulation_ratio[1], 1.0);
  EXPECT_GT(pattern.modulation_ratio[2], 1.0);
}

TEST(Commissioning, ErrorsHaveTheSizesOfTheFile) {
  const CommissioningErrorConfig sizes = Config().commissioning_error;
  const MeasuredNoise noise = MeasureNoise(Perfect());
  const MeasuredPattern pattern = MeasurePattern(Perfect(), ProjectedSet::kReduced);
  const auto relative = [](double measured, double truth) { return measured / truth - 1.0; };
  const double share = 0.15;  // of a standard deviation over 400 cells: 4 sigma
  EXPECT_NEAR(RmsOverCells([&](const auto& c) { return relative(MeasureNoise(c).read_dn, noise.read_dn); }),
              sizes.noise_sd, share * sizes.noise_sd);
  EXPECT_NEAR(RmsOverCells([&](const auto& c) { return relative(MeasureNoise(c).gain_dn, noise.gain_dn); }),
              sizes.noise_sd, share * sizes.noise_sd);
  EXPECT_NEAR(RmsOverCells([&](const auto& c) {
                return relative(MeasurePattern(c, ProjectedSet::kReduced).modulation_ratio[2],
                                pattern.modulation_ratio[2]);
              }),
              sizes.contrast_sd, share * sizes.contrast_sd);
  EXPECT_NEAR(RmsOverCells([&](const auto& c) {
                return relative(MeasureExpansion(c)->elongation[1], *ThermalStrain(900.0));
              }),
              sizes.expansion_sd, share * sizes.expansion_sd);
}

TEST(Commissioning, PutsWhatItMeasuredIntoTheStation) {
  for (const char* name : {"virtual", "virtual-small"}) {
    const auto text = CommissionedStation(Config(), StationText(name));
    ASSERT_TRUE(text.ok()) << text.error().message;
    const toml::table root = toml::parse(*text);
    EXPECT_NEAR(*root["reconstruction"]["read_noise_dn"].value<double>(), MeasureNoise(Config()).read_dn,
                1e-4);  // DN: printed digits
    EXPECT_NEAR(*root["reconstruction"]["gain_dn"].value<double>(), MeasureNoise(Config()).gain_dn, 1e-6);
    ASSERT_EQ(root["fusion"]["expansion"].as_array()->size(), 6u);
    EXPECT_NEAR(*root["fusion"]["expansion"][1].value<double>(), MeasureExpansion(Config())->elongation[1],
                1e-6);
  }
}

TEST(Commissioning, WhatTheStationSaysItselfStays) {
  const auto text = CommissionedStation(Config(), "[fusion]\n[reconstruction]  # mine\ngain_dn = 0.5\n");
  ASSERT_TRUE(text.ok()) << text.error().message;
  const toml::table root = toml::parse(*text);
  EXPECT_EQ(*root["reconstruction"]["gain_dn"].value<double>(), 0.5);
  EXPECT_TRUE(root["reconstruction"]["read_noise_dn"].is_floating_point());
}

TEST(Commissioning, HalfAnExpansionCurveIsRefused) {
  for (const char* key : {"expansion", "expansion_degc"}) {
    const auto half =
        CommissionedStation(Config(), fmt::format("[fusion]\n{} = [900.0, 1000.0]\n[reconstruction]\n", key));
    ASSERT_FALSE(half.ok()) << key;
    EXPECT_THAT(half.error().message, HasSubstr("only one of expansion_degc and expansion"));
  }
}

TEST(Commissioning, TheStationsImagesAreThoseOfTheCell) {
  const CellConfig config = *LoadCellConfig(kStations + "virtual/cell.toml", 4);
  EXPECT_TRUE(CheckImageSize(config, StationText("virtual-small")).ok());
  EXPECT_TRUE(
      CheckImageSize(*LoadCellConfig(kStations + "virtual/cell.toml", 1), StationText("virtual")).ok());
  const std::pair<std::string, const char*> wrong[] = {
      {StationText("virtual"), "width_px is 2448, the cell's images make it 612"},
      {"[camera]\nwidth_px = 612\nheight_px = 2048\n", "height_px is 2048, the cell's images make it 512"},
      {"[trigger]\nframe_bytes = 5013504\n", "frame_bytes is 5013504, the cell's images make it 313344"},
      {"[camera", "line 1"}};
  for (const auto& [text, what] : wrong) {
    const Status status = CheckImageSize(config, text);
    ASSERT_FALSE(status.ok()) << what;
    EXPECT_THAT(status.error().message, HasSubstr(what));
  }
}

TEST(Commissioning, RefusesATextWithoutItsTables) {
  const auto missing = CommissionedStation(Config(), "[reconstruction]\n");
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, HasSubstr("[fusion] is missing"));
  const auto broken = CommissionedStation(Config(), "[fusion]\n[recon");
  ASSERT_FALSE(broken.ok());
  EXPECT_THAT(broken.error().message, HasSubstr("line 2"));
}

// Error of the axle's length by temperature alone, in the warmest view: pyrometer, curve, cooling of the
// part.
double ThermalLengthErrorMm(const CellConfig& config) {
  const auto measured = *MeasureExpansion(config);
  const auto curve = *ExpansionCurve::Create(measured.degc, measured.elongation);
  RandomStream random(config.seed, RandomUse::kPartHeat, {1});
  const HeatConfig& heat = config.heat;
  const double degc =
      *TemperatureAfter(heat.law, heat.start_degc + heat.start_sd_k * random.Gaussian(), heat.first_view_s);
  const Pyrometer pyrometer{heat.pyrometer_bias_sd_k * random.Gaussian(), heat.pyrometer_noise_sd_k};
  const double read_degc = pyrometer.Read(degc, random);
  const double scale = *SizeScale(degc, heat.reference_degc) * *curve.Scale(read_degc, heat.reference_degc);
  return config.part.nominal.total_length_mm * (scale - 1.0);
}

// The report's uncertainty of temperature and expansion must stand for what is wrong with both.
TEST(Commissioning, ThermalErrorsAreWithinTheStatedUncertainty) {
  const UncertaintyBudget budget;
  const double stated_mm =
      Config().part.nominal.total_length_mm * budget.expansion_slope_per_k * budget.temperature_k;
  const double rms_mm = RmsOverCells(ThermalLengthErrorMm);
  RecordProperty("rms_um", static_cast<int>(std::lround(1000.0 * rms_mm)));
  EXPECT_LT(rms_mm, stated_mm);
  EXPECT_GT(rms_mm, 0.02);  // mm: half of what 1 K does; less would say that the simulator cannot hurt
}

}  // namespace
}  // namespace forgescan
