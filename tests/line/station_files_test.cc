// The station files of this repository are what the services accept, with and without the keys that stand in
// them as comments.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "services/camera/camera_config.h"
#include "services/common/service/station.h"
#include "services/cooling/cooling_config.h"
#include "services/fusion/fusion_config.h"
#include "services/reconstruction/reconstruction_service.h"
#include "services/registration/registration_config.h"
#include "services/report/report_config.h"
#include "services/robot/robot_config.h"
#include "services/trigger/trigger_config.h"
#include "tools/forgescan/station/supervision_policy.h"

namespace forgescan {
namespace {

const std::string kStations = FORGESCAN_SOURCE_DIR "/stations/";

template <typename Loaded>
void ExpectLoaded(const Loaded& loaded) {
  EXPECT_TRUE(loaded.ok()) << loaded.error().message;
}

void ExpectAllLoad(const ConfigFile& file) {
  ExpectLoaded(TriggerConfig::Load(file.Table("trigger")));
  ExpectLoaded(CameraConfig::Load(file.Table("camera"), "left"));
  ExpectLoaded(CameraConfig::Load(file.Table("camera"), "right"));
  ExpectLoaded(RobotConfig::Load(file.Table("robot")));
  ExpectLoaded(CoolingConfig::Load(file.Table("cooling")));
  ExpectLoaded(ReconstructionServiceConfig::Load(file.Table("reconstruction")));
  ExpectLoaded(FusionConfig::Load(file.Table("fusion")));
  ExpectLoaded(RegistrationConfig::Load(file.Table("registration")));
  ExpectLoaded(ReportConfig::Load(file.Table("report")));
  ExpectLoaded(SupervisionPolicy::Load(file));
}

TEST(StationFiles, TheTemplateIsOneTheServicesAccept) {
  const auto station = Station::Load(kStations + "template");
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_EQ(station->can_url, "socketcan:can0");
  ExpectAllLoad(station->file);
}

TEST(StationFiles, SoIsWhatStandsInItAsComment) {
  std::stringstream text;
  text << std::ifstream(kStations + "template/station.toml").rdbuf();
  const std::string whole = std::regex_replace(text.str(), std::regex("\n# (\\w+ = )"), "\n$1");
  EXPECT_GT(whole.size(), 0u);
  EXPECT_EQ(whole.find("\n# silence_s"), std::string::npos);
  const auto file = ConfigFile::Parse(whole, "template/station.toml");
  ASSERT_TRUE(file.ok()) << file.error().message;
  ExpectAllLoad(*file);
  EXPECT_EQ(SupervisionPolicy::Load(*file)->silence_s, SupervisionPolicy().silence_s);
  EXPECT_EQ(ReportConfig::Load(file->Table("report"))->part_timeout_s, ReportConfig().part_timeout_s);
  EXPECT_EQ(FusionConfig::Load(file->Table("fusion"))->view_timeout_s, FusionConfig().view_timeout_s);
  EXPECT_EQ(RobotConfig::Load(file->Table("robot"))->gate_timeout_s, RobotConfig().gate_timeout_s);
}

TEST(StationFiles, TheVirtualOnesNameTheSupervisionThatTheyNeed) {
  for (const char* name : {"virtual", "virtual-small"}) {
    const auto station = Station::Load(kStations + name);
    ASSERT_TRUE(station.ok()) << station.error().message;
    ExpectLoaded(SupervisionPolicy::Load(station->file));
  }
}

}  // namespace
}  // namespace forgescan
