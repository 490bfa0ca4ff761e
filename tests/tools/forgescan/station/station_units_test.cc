// The systemd units of a station: complete, in order, and to systemd's own checker without a word of blame.
#include "tools/forgescan/station/station_units.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "tests/run_command.h"
#include "tools/forgescan/station/station_services.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

std::map<std::string, std::string> TextsOf(const std::string& can_url,
                                           const std::vector<std::string>& more_services = {}) {
  Station station;
  station.more_services = more_services;
  station.name = "cell-1";
  station.bus_url = "udpm://239.255.76.67:7667?ttl=0";
  station.can_url = can_url;
  station.results = "/srv/cell-1/results";
  const UnitOptions options{"/srv/cell-1", "/opt/forgescan/bin", "forgescan", "", "/data/recordings"};
  std::map<std::string, std::string> texts;
  const auto units = MakeUnits(station, {}, options);
  EXPECT_TRUE(units.ok());
  for (const UnitFile& unit : units.ok() ? *units : std::vector<UnitFile>{}) {
    texts[unit.name] = unit.text;
  }
  return texts;
}

TEST(StationUnits, OneAServiceATargetAndARoute) {
  const auto texts = TextsOf("socketcan:can0");
  EXPECT_EQ(texts.size(), 2 + StationServices({}).size());
  const std::string robot = texts.at("forgescan-cell-1-robot.service");
  EXPECT_THAT(robot, HasSubstr("ExecStart=/opt/forgescan/bin/forgescan-robot --station /srv/cell-1\n"));
  EXPECT_THAT(robot, HasSubstr("Type=notify\n"));
  EXPECT_THAT(robot, HasSubstr("WatchdogSec=5\n"));
  EXPECT_THAT(robot, HasSubstr("AF_CAN"));
  EXPECT_THAT(robot, HasSubstr("forgescan-cell-1-camera_left.service"));
  EXPECT_THAT(robot, HasSubstr("ReadWritePaths=/srv/cell-1/log /srv/cell-1/results\n"));
  EXPECT_THAT(robot, HasSubstr("TimeoutStopSec=10\n"));
  for (const char* limit : {"LimitNOFILE=4096\n", "LimitRTPRIO=20\n", "LimitMEMLOCK=1G\n"}) {
    EXPECT_THAT(robot, HasSubstr(limit)) << "as in tools/setup-host";
  }
  const std::string recorder = texts.at("forgescan-cell-1-recorder.service");
  EXPECT_THAT(recorder, HasSubstr("ReadWritePaths=/srv/cell-1/log /srv/cell-1/results /data/recordings\n"));
  EXPECT_THAT(recorder, HasSubstr("TimeoutStopSec=40\n")) << "its backlog is to be written";
  const std::string camera = texts.at("forgescan-cell-1-camera_left.service");
  EXPECT_THAT(camera, HasSubstr("forgescan-camera left --station"));
  EXPECT_THAT(camera, Not(HasSubstr("AF_CAN")));
  EXPECT_THAT(camera, Not(HasSubstr("-robot.service"))) << "started before the robot, stopped after it";
  EXPECT_THAT(texts.at("forgescan-cell-1-route.service"), HasSubstr("route replace 239.255.76.67/32 dev lo"));
  EXPECT_THAT(texts.at("forgescan-cell-1.target"), HasSubstr("forgescan-cell-1-report.service"));
}

TEST(StationUnits, AServiceOfTheStationAloneStartsBehindTheRecorderAndBeforeAllOthers) {
  const auto texts = TextsOf("socketcan:can0", {"takt"});
  const std::string takt = texts.at("forgescan-cell-1-takt.service");
  EXPECT_THAT(takt, HasSubstr("ExecStart=/opt/forgescan/bin/forgescan-takt --station /srv/cell-1\n"));
  EXPECT_THAT(takt, HasSubstr("-recorder.service\n"));
  EXPECT_THAT(takt, Not(HasSubstr("-report.service")));
  EXPECT_THAT(texts.at("forgescan-cell-1-report.service"), HasSubstr("-takt.service"));
  EXPECT_THAT(texts.at("forgescan-cell-1.target"), HasSubstr("-takt.service"));
}

TEST(StationUnits, AStationWithCanOverUdpNeedsNoCanSocketsButARouteMore) {
  const auto texts = TextsOf("udp:239.74.163.2:43113");
  EXPECT_THAT(texts.at("forgescan-cell-1-robot.service"), Not(HasSubstr("AF_CAN")));
  EXPECT_THAT(texts.at("forgescan-cell-1-route.service"), HasSubstr("239.74.163.2/32"));
}

TEST(StationUnits, RefusesNamesThatWouldMeanSomethingElse) {
  Station station;
  station.name = "cell";
  station.results = "/srv/results";
  const UnitOptions good{"/srv/cell", "/opt/bin", "forgescan", "", "/data/recordings"};
  EXPECT_TRUE(MakeUnits(station, {}, good).ok());
  for (const char* folder : {"/srv/my cell", "/srv/50%", "/srv/a\nb", "", "/srv/$HOME"}) {
    UnitOptions wrong = good;
    wrong.folder = folder;
    EXPECT_FALSE(MakeUnits(station, {}, wrong).ok()) << folder;
    wrong = good;
    wrong.recordings = folder;
    EXPECT_FALSE(MakeUnits(station, {}, wrong).ok()) << folder;
  }
  for (const char* name : {"../cell", "a cell", "a/b"}) {
    station.name = name;
    EXPECT_FALSE(MakeUnits(station, {}, good).ok()) << name;
  }
}

// Whole files, as the command writes them, past systemd-analyze verify.
class Verified : public ::testing::TestWithParam<const char*> {};

TEST_P(Verified, HasNothingSystemdWouldWarnOf) {
  if (std::system("command -v systemd-analyze >/dev/null 2>&1") != 0) {
    GTEST_SKIP() << "systemd-analyze is not installed (package systemd)";
  }
  const fs::path base = fs::path(::testing::TempDir()) / ("forgescan_units_" + std::to_string(getpid()));
  fs::create_directories(base / "cell/log");
  fs::create_directories(base / "cell/results");
  std::ofstream(base / "cell/station.toml")
      << "[station]\nname = \"cell\"\nbus = \"udpm://239.255.76.67:7667?ttl=0\"\ncan = \"" << GetParam()
      << "\"\ncalibration = \"c\"\npattern = \"p\"\nviews = \"v\"\nmodel = \"m\"\nfeatures = \"f\"\n"
         "results = \"results\"\n[recorder]\nfolder = \"../disk/recordings\"\n";
  const CommandOutput written = RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station units " +
                                           (base / "cell").string() + " --out " + (base / "units").string());
  ASSERT_EQ(written.exit_code, 0) << written.text;
  EXPECT_THAT(written.text, HasSubstr("\n" + (base / "disk/recordings").string() + "\n"));
  std::ifstream recorder(base / "units/forgescan-cell-recorder.service");
  EXPECT_THAT(std::string(std::istreambuf_iterator<char>(recorder), {}),
              HasSubstr(" " + (base / "disk/recordings").string() + "\n"));
  const CommandOutput verified =
      RunCommand("systemd-analyze verify --man=no " + (base / "units").string() + "/*");
  EXPECT_EQ(verified.exit_code, 0);
  EXPECT_EQ(verified.text, "");
  fs::remove_all(base);
}

INSTANTIATE_TEST_SUITE_P(CanBuses, Verified, ::testing::Values("socketcan:can0", "udp:239.74.163.2:43113"),
                         [](const auto& param) {
                           return std::string(param.param).starts_with("udp") ? "Udp" : "SocketCan";
                         });

}  // namespace
}  // namespace forgescan
