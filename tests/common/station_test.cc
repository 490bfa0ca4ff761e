// Which services a station has, by its file.
#include "services/common/service/station.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr const char* kStation = R"([station]
name = "s"
bus = "udpm://239.255.76.67:7667?ttl=0"
can = "socketcan:can0"
calibration = "c"
pattern = "p"
views = "v"
model = "m"
features = "f"
results = "r"
)";

class StationTest : public ::testing::Test {
 protected:
  StationTest() { fs::create_directories(folder_); }
  ~StationTest() override { fs::remove_all(folder_); }

  Result<Station> Load(const std::string& tables) const {
    std::ofstream(folder_ / "station.toml") << kStation << tables;
    return Station::Load(folder_.string());
  }
  std::string ErrorOf(const std::string& tables) const {
    const auto station = Load(tables);
    return station.ok() ? "loaded" : station.error().message;
  }
  const fs::path folder_ = fs::temp_directory_path() / ("station_test_" + std::to_string(getpid()));
};

TEST_F(StationTest, HasNoServicesOfItsOwnUnlessItsFileNamesThem) {
  const auto station = Load("[trigger]\n");
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_TRUE(station->more_services.empty());
}

TEST_F(StationTest, EveryTableBelowServiceIsOne) {
  const auto station = Load("[service.takt]\nlimit_s = 3\n[service.lamp_2]\n");
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_THAT(station->more_services, ElementsAre("lamp_2", "takt"));
  double limit_s = 0;
  ConfigTable table = station->file.Table("service").Table("takt");
  table.Required("limit_s", limit_s, 1, 5);
  EXPECT_TRUE(table.Finish().ok());
  EXPECT_EQ(limit_s, 3);
}

TEST_F(StationTest, ATableBesideServiceIsUnknownAsBefore) {
  EXPECT_THAT(ErrorOf("[takt]\n"), HasSubstr("unknown table takt"));
}

TEST_F(StationTest, ANameThatIsTakenOrNoneIsAnError) {
  for (const char* name : {"robot", "camera", "camera_left", "supervisor", "station", "route", "inspect"}) {
    EXPECT_THAT(ErrorOf("[service." + std::string(name) + "]\n"),
                HasSubstr("service." + std::string(name) + " has a name that is taken"));
  }
  for (const char* name : {"Takt", "2takt", "ta-kt", "'../takt'", "''", "_takt", "fifteen_letters"}) {
    EXPECT_THAT(ErrorOf("[service." + std::string(name) + "]\n"), HasSubstr("is no name of a service"))
        << name;
  }
  EXPECT_EQ(ErrorOf("[service.fourteen_chars]\n"), "loaded");
}

TEST_F(StationTest, AValueInThePlaceOfAServiceIsAnError) {
  EXPECT_THAT(ErrorOf("[service]\ntakt = 3\n"), HasSubstr("service.takt must be a table"));
}

}  // namespace
}  // namespace forgescan
