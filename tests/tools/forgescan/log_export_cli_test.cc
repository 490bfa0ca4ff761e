// Making files of recordings that other programs read.
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "services/common/geometry/cloud_io.h"
#include "tests/tools/forgescan/log_cli.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;
using LogExportCli = LogCli;

TEST_F(LogExportCli, ExportMakesFilesOfEverything) {
  const TestRecording recording = TestRecording::Make();
  Write(recording);
  const CommandOutput output = Call("export a.log --out b/");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_EQ(Files("b"),
            (std::vector<std::string>{"7_0_0_left_1.png", "7_0_0_right_1.png", "7_1_0_left_2.png",
                                      "7_1_0_right_2.png", "7_2_0_left_3.png", "7_2_0_right_3.png",
                                      "RECORDED_FILE.jsonl", "RECORDING_CLOSED.jsonl",
                                      "RECORDING_OPENED.jsonl", "SERVICE_STATE.jsonl", "VERDICT.jsonl",
                                      "VIEW_CLOUD_7_0.ply", "VIEW_CLOUD_7_1.ply", "VIEW_CLOUD_7_2.ply"}));
  const cv::Mat image = cv::imread(folder_ / "b/7_1_0_right_2.png", cv::IMREAD_UNCHANGED);
  const auto frame = Decode<fsmsg::frame_t>(recording.events[recording.Find("FRAME_RIGHT", 1)].message);
  ASSERT_EQ(image.type(), CV_8UC1);
  ASSERT_EQ(image.total(), frame->data.size());
  EXPECT_TRUE(std::equal(frame->data.begin(), frame->data.end(), image.data));
  const auto cloud = ReadPointCloud(folder_ / "b/VIEW_CLOUD_7_2.ply");
  ASSERT_TRUE(cloud.ok());
  EXPECT_EQ(cloud->points.size(), 5u);
  EXPECT_EQ(cloud->points[4], Eigen::Vector3f(4, 2, 1000));
  std::ifstream lines(folder_ / "b/SERVICE_STATE.jsonl");
  int states = 0;
  for (std::string line; std::getline(lines, line); ++states) {
    EXPECT_EQ(Json::parse(line)["message"]["name"], "camera_left");
  }
  EXPECT_EQ(states, 3);
  std::ifstream file(folder_ / "b/RECORDED_FILE.jsonl");
  EXPECT_EQ(Json::parse(file)["message"]["data"], "YSA9IDE=");  // a = 1
  ASSERT_EQ(Call("export a.log --out clouds --clouds").exit_code, 0);
  EXPECT_EQ(Files("clouds").size(), 3u);
}

TEST_F(LogExportCli, ExportSaysWhatItHadToLeaveOut) {
  TestRecording recording = TestRecording::Make();
  recording.events[recording.Find("VIEW_CLOUD", 1)].message.back() ^= 1;
  Write(recording);
  const CommandOutput output = Call("export a.log --out b");
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.text, HasSubstr("VIEW_CLOUD: a message of"));
  EXPECT_THAT(output.text, HasSubstr("left out: 1 messages or clouds, 0 damaged stretches"));
  EXPECT_EQ(Files("b").size(), 13u);
  EXPECT_THAT(Call("export a.log --out b").text, HasSubstr("b: exists already"));
  EXPECT_THAT(Call("export a.log").text, HasSubstr("needs --out FOLDER, --mcap FILE or both"));
  EXPECT_NE(Call("export a.log --out nowhere/b").exit_code, 0);
  EXPECT_NE(Call("export nothing.log --out c").exit_code, 0);
  EXPECT_EQ(Files("."), (std::vector<std::string>{"a.log", "b"}));
}

TEST_F(LogExportCli, ExportsToMcap) {
  Write(TestRecording::Make());
  const CommandOutput output = Call("export a.log --mcap b.mcap");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_EQ(output.text, "b.mcap: 16 messages\n");
  EXPECT_THAT(Call("export a.log --mcap b.mcap").text, HasSubstr("b.mcap: exists already"));
  EXPECT_EQ(Files("."), (std::vector<std::string>{"a.log", "b.mcap"}));
}

TEST_F(LogExportCli, BothExportsAreMadeOfADamagedLog) {
  TestRecording recording = TestRecording::Make();
  recording.events[recording.Find("VIEW_CLOUD", 1)].message.back() ^= 1;
  Write(recording);
  const CommandOutput output = Call("export a.log --out b --mcap b.mcap");
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.text, HasSubstr("b.mcap: 15 messages"));
  EXPECT_EQ(Files("."), (std::vector<std::string>{"a.log", "b", "b.mcap"}));
}

// Wider than a PNG may be.
TEST_F(LogExportCli, AnImageThatIsNoneIsLeftOutAndTheRestExported) {
  TestRecording recording = TestRecording::Make();
  fsmsg::frame_t frame{};
  frame.part = kTestPart;
  frame.width_px = 2'000'000;
  frame.height_px = 1;
  frame.data.resize(2'000'000);
  frame.size = 2'000'000;
  recording.AddToStream("FRAME_LEFT", frame);
  Write(recording);
  const CommandOutput output = Call("export a.log --out b --mcap b.mcap");
  EXPECT_EQ(output.exit_code, 1);
  EXPECT_THAT(output.text, HasSubstr("an image of 2000000 x 1 px cannot be written as PNG"));
  EXPECT_THAT(output.text, HasSubstr("left out: 1 messages or clouds"));
  EXPECT_EQ(Files("b").size(), 14u);
  EXPECT_THAT(output.text, HasSubstr("b.mcap: 16 messages"));
}

TEST_F(LogExportCli, AnErrorHasTheSystemsReason) {
  Write(TestRecording::Make());
  EXPECT_THAT(Call("export a.log --mcap nowhere/b.mcap").text, HasSubstr("(No such file or directory)"));
}

TEST_F(LogExportCli, ChannelsWithNamesInUtf8) {
  TestRecording recording = TestRecording::Make();
  recording.events.insert(recording.events.end() - 1, {"Kamera_\xC3\xB6", recording.Now(), Bytes(20, 1)});
  Write(recording);
  const CommandOutput output = Call("export a.log --out b --mcap b.mcap");
  EXPECT_EQ(output.exit_code, 0) << output.text;
  std::ifstream file(folder_ / "b/Kamera___.jsonl");
  EXPECT_EQ(Json::parse(file)["channel"], "Kamera_\xC3\xB6");
}

}  // namespace
}  // namespace forgescan
