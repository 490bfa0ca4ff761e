#include "tools/forgescan/replay/recorded_station.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TestFolder;
using testing::WrittenRecording;

constexpr const char* kStation = R"([station]
name = "test"
bus = "udpm://239.255.76.67:7667?ttl=0"
can = "udp:239.74.163.2:43113"
calibration = "anywhere/stereo.yaml"
pattern = "pattern.toml"
views = "views.toml"
model = "axle.bundle"
features = "features.toml"
results = "results"
[fusion]
view_timeout_s = 60.0
)";

class RecordedStationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Record({"calibration.yaml", "pattern.toml", "views.toml", "model.bundle", "features.toml"});
  }
  void Record(const std::vector<std::string>& files, const std::string& station = kStation) {
    std::filesystem::remove(folder_ / "one.lcmlog");
    WrittenRecording recording(folder_ / "one.lcmlog");
    recording.File("station.toml", station);
    for (const std::string& file : files) {
      recording.File(file, "recorded " + file);
    }
    recording.Close();
    auto session = RecordedSession::Open({folder_ / "one.lcmlog"});
    ASSERT_TRUE(session.ok()) << session.error().message;
    session_.emplace(std::move(*session));
    unpacked_ = folder_.path() / "station";
    std::filesystem::remove_all(unpacked_);
    std::filesystem::create_directories(unpacked_);
  }
  Result<Station> Unpack(const StationChanges& changes) {
    return UnpackStation(*session_, changes, unpacked_);
  }
  std::vector<std::string> Changes(const Station& station) {
    const auto changes = DescribeChanges(*session_, station);
    EXPECT_TRUE(changes.ok()) << changes.error().message;
    return changes.ok() ? *changes : std::vector<std::string>{};
  }
  static std::string Text(const std::string& path) {
    std::ifstream stream(path);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  TestFolder folder_;
  std::optional<RecordedSession> session_;
  std::filesystem::path unpacked_;
};

TEST_F(RecordedStationTest, IsTheRecordedOneWithoutChanges) {
  const auto station = Unpack({});
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_EQ(Text(station->calibration), "recorded calibration.yaml");
  EXPECT_EQ(Text(station->model), "recorded model.bundle");
  EXPECT_EQ(station->results, (unpacked_ / "results").string());
  EXPECT_EQ(station->file.hash(), ConfigFile::Parse(kStation, "")->hash());
  EXPECT_THAT(Changes(*station), IsEmpty());
}

TEST_F(RecordedStationTest, SetsValuesAndNamesThem) {
  const auto station = Unpack(
      {.config = "", .values = {"fusion.view_timeout_s=30.5", "report.deviation_scale_mm=0.2"}, .files = {}});
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_THAT(Changes(*station), ElementsAre("fusion.view_timeout_s = 30.5, recorded as 60",
                                             "report.deviation_scale_mm = 0.2, recorded as the default"));
}

TEST_F(RecordedStationTest, TakesAnotherConfigurationAndOtherFiles) {
  std::ofstream(folder_ / "other.toml")
      << std::string(kStation).replace(std::string(kStation).find("60.0"), 4, "61.0");
  std::ofstream(folder_ / "stereo.yaml") << "another";
  const auto station = Unpack(
      {.config = folder_ / "other.toml", .values = {}, .files = {{"calibration", folder_ / "stereo.yaml"}}});
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_EQ(Text(station->calibration), "another");
  EXPECT_THAT(Changes(*station), Contains(HasSubstr("calibration is another file")));
  EXPECT_THAT(Changes(*station), Contains("fusion.view_timeout_s = 61, recorded as 60"));
}

TEST_F(RecordedStationTest, AStationMayHaveStandingSurfaces) {
  EXPECT_EQ(Unpack({})->standing, "");
  const std::vector<std::string> files{"calibration.yaml", "pattern.toml",  "views.toml",
                                       "model.bundle",     "features.toml", "standing.ply"};
  std::string with = kStation;
  with.insert(with.find("results ="), "standing = \"views/standing.ply\"\n");
  Record(files, with);
  const auto station = Unpack({});
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_EQ(Text(station->standing), "recorded standing.ply");
  EXPECT_THAT(Changes(*station), IsEmpty());
  Record({files.begin(), files.end() - 1}, with);
  EXPECT_THAT(Unpack({}).error().message, HasSubstr("holds no file for standing; --standing FILE gives one"));
}

TEST_F(RecordedStationTest, StandingSurfacesMayBeGivenToAStationThatHadNone) {
  std::ofstream(folder_ / "mine.ply") << "mine";
  const auto station = Unpack({.config = "", .values = {}, .files = {{"standing", folder_ / "mine.ply"}}});
  ASSERT_TRUE(station.ok()) << station.error().message;
  EXPECT_EQ(Text(station->standing), "mine");
  EXPECT_THAT(Changes(*station), Contains(HasSubstr("standing is another file")));
}

TEST_F(RecordedStationTest, RefusesWhatIsNoValue) {
  for (const char* change :
       {"fusion", "view_timeout_s=3", "fusion.view_timeout_s=", "fusion.view_timeout_s=a b",
        "fusion.view_timeout_s.x=1", "fusion.x={}", "report.uncertainty={a=1,b=2}",
        "#fusion.view_timeout_s=1", "fusion.view_timeout_s=1\nfusion.max_body_change_k=2"}) {
    const auto station = Unpack({.config = "", .values = {change}, .files = {}});
    ASSERT_FALSE(station.ok()) << change;
    EXPECT_THAT(station.error().message, HasSubstr(change));
  }
}

TEST_F(RecordedStationTest, RefusesAChangeThatNothingComputedReads) {
  const auto check = [](const StationChanges& changes, const std::vector<std::string>& services) {
    const Status status = CheckUsed(changes, services);
    return status.ok() ? "" : status.error().message;
  };
  const StationChanges cooling{.config = "", .values = {"cooling.setpoint_degc=20"}, .files = {}};
  EXPECT_THAT(check(cooling, {"fusion", "report"}),
              HasSubstr("nothing that is computed here reads [cooling]"));
  const StationChanges fusion{.config = "", .values = {" \"fusion\" .view_timeout_s=20"}, .files = {}};
  EXPECT_EQ(check(fusion, {"fusion"}), "");
  EXPECT_THAT(check(fusion, {"report"}), HasSubstr("reads [fusion]"));
  const StationChanges views{.config = "", .values = {}, .files = {{"views", "v.toml"}}};
  EXPECT_EQ(check(views, {"fusion"}), "");
  EXPECT_THAT(check(views, {"report"}), HasSubstr("the file for views"));
}

TEST_F(RecordedStationTest, NamesAFileThatWasNotRecorded) {
  Record({"calibration.yaml", "pattern.toml", "views.toml", "features.toml"});
  const auto station = Unpack({});
  ASSERT_FALSE(station.ok());
  EXPECT_THAT(station.error().message, HasSubstr("holds no file for model; --model FILE gives one"));
}

}  // namespace
}  // namespace forgescan
