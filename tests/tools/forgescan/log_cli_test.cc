// forgescan log as a user or a script calls it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "services/common/geometry/cloud_io.h"
#include "services/common/log/log_reader.h"
#include "tests/common/real_data.h"
#include "tests/tools/forgescan/test_recording.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

struct Output {
  int exit_code = -1;
  std::string text;  // standard output and error
};

class LogCli : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  Output Call(const std::string& arguments) const {
    Output output;
    const std::string command =
        "cd " + folder_.string() + " && " + FORGESCAN_BIN_DIR + "/forgescan log 2>&1 " + arguments;
    FILE* pipe = popen(command.c_str(), "r");
    std::array<char, 4096> buffer{};
    while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
      output.text += buffer.data();
    }
    output.exit_code = WEXITSTATUS(pclose(pipe));
    return output;
  }
  std::string Path(const std::string& name) const { return folder_ / name; }
  void Write(const TestRecording& recording, const std::string& name = "a.log") const {
    fs::remove(folder_ / name);
    recording.WriteTo(Path(name));
  }
  // Changes bytes of the file.
  void Patch(std::uint64_t at, const std::string& bytes) const {
    std::fstream file(folder_ / "a.log", std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>(at));
    file << bytes;
  }
  void ExpectFinding(const std::string& what) const {
    const Output output = Call("check a.log");
    EXPECT_EQ(output.exit_code, 1) << output.text;
    EXPECT_THAT(output.text, HasSubstr(what));
  }
  std::vector<std::string> Channels(const std::string& name) const {
    const auto log = LogReader::Open(Path(name));
    EXPECT_TRUE(log.ok());
    std::vector<std::string> channels;
    for (const LogEntry& entry : log.ok() ? log->entries() : std::vector<LogEntry>()) {
      channels.push_back(log->ChannelOf(entry));
    }
    return channels;
  }
  std::vector<std::string> Files(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / folder)) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("log_cli_" + std::to_string(getpid()));
};

TEST_F(LogCli, InfoStartsWithWhatARecordingHolds) {
  Write(TestRecording::Make());
  const Output output = Call("info --json a.log a.log");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json both = Json::parse(output.text);
  ASSERT_EQ(both.size(), 2u);
  const Json& info = both[0];
  EXPECT_EQ(info["events"], 16);
  EXPECT_EQ(info["file_bytes"].get<std::uintmax_t>(), fs::file_size(Path("a.log")));
  EXPECT_EQ(info["opened"]["station"], "test");
  EXPECT_EQ(info["closed"]["verdict"], "OK");
  EXPECT_TRUE(info["damage"].empty());
  ASSERT_EQ(info["channels"].size(), 8u);
  const Json& frames = info["channels"][0];
  EXPECT_EQ(frames["channel"], "FRAME_LEFT");
  EXPECT_EQ(frames["events"], 3);
  EXPECT_NEAR(frames["rate_hz"].get<double>(), 2.5, 1e-9);  // one each 4 events of 0.1 s
  EXPECT_EQ(frames["types"][0]["type"], "fsmsg.frame_t");
  const Output text = Call("info a.log");
  EXPECT_THAT(text.text, HasSubstr("recording of part 7 at station test, version 1.2.3"));
  EXPECT_THAT(text.text, HasSubstr("closed: the part was sorted; verdict OK; 0 gaps"));
}

TEST_F(LogCli, InfoOfARealLog) {
  const auto data = RealData("lcm-log");
  if (!data) GTEST_SKIP() << "lcm-log" << kNoRealData;
  const Output output = Call("info --json " + (*data / "convex.log").string());
  ASSERT_EQ(output.exit_code, 0) << output.text;
  const Json info = Json::parse(output.text)[0];
  EXPECT_EQ(info["events"], 5714);
  EXPECT_TRUE(info["damage"].empty());
  // As its README says.
  const Json expected = Json::parse(R"([["MAEBOT_ENCODERS", 3422, 82128, "7d090bfb221d74f9"],
    ["MAEBOT_IMU", 1376, 121088, "ed966784146237ec"], ["RPLIDAR_LASER", 459, 2746580, "89dc5b879a5056cf"],
    ["SLAM_POSE", 457, 12796, "1f317af1246276ac"]])");
  ASSERT_EQ(info["channels"].size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Json& channel = info["channels"][i];
    ASSERT_EQ(channel["types"].size(), 1u);
    EXPECT_EQ(
        Json({channel["channel"], channel["events"], channel["bytes"], channel["types"][0]["fingerprint"]}),
        expected[i]);
  }
}

TEST_F(LogCli, CheckAcceptsOnlyWhatIsWholeAndComplete) {
  Write(TestRecording::Make());
  const Output output = Call("check a.log");
  EXPECT_EQ(output.exit_code, 0) << output.text;
  EXPECT_EQ(output.text, "a.log: whole and complete, 16 events\n");
}

TEST_F(LogCli, CheckFindsAWrongBitInAPixel) {
  TestRecording recording = TestRecording::Make();
  recording.events[recording.Find("FRAME_LEFT", 1)].message.back() ^= 1;
  Write(recording);
  ExpectFinding("FRAME_LEFT: a message of 665 bytes has a wrong CRC-32");
  ExpectFinding("FRAME_LEFT: the closing event counts 3 events with 1995 bytes and CRC-32");
}

TEST_F(LogCli, CheckFindsWhatIsMissing) {
  TestRecording recording = TestRecording::Make();
  recording.events.erase(recording.events.begin() +
                         static_cast<std::ptrdiff_t>(recording.Find("FRAME_RIGHT", 1)));
  Write(recording);
  ExpectFinding(
      "FRAME_RIGHT: sequence 2 to 2 of session 1700000000000000 are not in the file, or not intact");
  ExpectFinding("FRAME_RIGHT: the closing event counts 3 events");
  recording.events.pop_back();
  Write(recording);
  ExpectFinding("RECORDING_CLOSED: is missing");
  recording.events.erase(recording.events.begin());
  Write(recording);
  ExpectFinding("RECORDING_OPENED: is missing");
}

// Sequences that belong to other parts are not in a part's recording.
TEST_F(LogCli, CheckAcceptsHolesThatTheClosingEventKnows) {
  TestRecording recording = TestRecording::Make();
  recording.events.pop_back();
  recording.events.erase(recording.events.begin() +
                         static_cast<std::ptrdiff_t>(recording.Find("FRAME_RIGHT", 1)));
  recording.Close({});
  Write(recording);
  EXPECT_EQ(Call("check a.log").exit_code, 0);
  recording.events.pop_back();
  fsmsg::recording_gap_t gap{};
  gap.channel = "FRAME_RIGHT";
  gap.first_sequence = gap.last_sequence = 2;
  gap.reason = "it was not received";
  recording.Close({gap});
  Write(recording);
  ExpectFinding("FRAME_RIGHT: the closing event names a gap: sequence 2 to 2: it was not received");
  ExpectFinding("FRAME_RIGHT: sequence 2 to 2 of session");
}

TEST_F(LogCli, CheckFindsWhatDoesNotBelong) {
  TestRecording recording = TestRecording::Make();
  TestEvent verdict = recording.events[recording.Find("VERDICT")];
  recording.events.insert(recording.events.end() - 1, verdict);
  Write(recording);
  ExpectFinding("VERDICT: sequence 1 of session 1700000000000000 comes after 1");
  recording = TestRecording::Make();
  recording.events.push_back(verdict);
  Write(recording);
  ExpectFinding("RECORDING_CLOSED: 1 events follow it");
  recording = TestRecording::Make();
  recording.events.pop_back();
  recording.Close({}, fsmsg::verdict_t::VERDICT_NOT_OK);
  Write(recording);
  ExpectFinding("RECORDING_CLOSED: says that the verdict is NOT_OK, VERDICT says OK");
  recording = TestRecording::Make();
  recording.events[recording.Find("SERVICE_STATE")].message.push_back(0);
  recording.events[recording.Find("SERVICE_STATE", 1)].message.resize(5);
  recording.events[recording.Find("SERVICE_STATE", 2)].message[0] ^= 1;
  recording.events[recording.Find("RECORDED_FILE")].message.back() ^= 1;
  recording.events[recording.Find("VERDICT")].message =
      recording.events[recording.Find("VIEW_CLOUD")].message;
  Write(recording);
  ExpectFinding("fsmsg.service_state_t: 1 bytes too many");
  ExpectFinding("SERVICE_STATE: 5 bytes are no LCM message");
  ExpectFinding("SERVICE_STATE: 1 messages from here on are of the unknown type");
  ExpectFinding("RECORDED_FILE: station.toml has the CRC-32");
  ExpectFinding("VERDICT: is a fsmsg.cloud_slice_t, not what the opening event announces");
}

TEST_F(LogCli, CheckFindsDamage) {
  const TestRecording recording = TestRecording::Make();
  Write(recording);
  const auto log = LogReader::Open(Path("a.log"));
  ASSERT_TRUE(log.ok());
  Patch(log->entries()[5].offset, "bad!");
  ExpectFinding(fmt::format("byte {}: ", log->entries()[5].offset));
  ExpectFinding("bytes are damaged: an event with a bad sync word");
  const Output two = Call("check a.log nothing.log");
  EXPECT_EQ(two.exit_code, 1);
  EXPECT_THAT(two.text, HasSubstr("nothing.log: No such file"));
  EXPECT_THAT(two.text, HasSubstr("in 2 of 2 logs"));
}

TEST_F(LogCli, RepairKeepsWhatIsUndamagedAndSaysWhatIsNot) {
  const TestRecording recording = TestRecording::Make();
  Write(recording);
  const auto log = LogReader::Open(Path("a.log"));
  ASSERT_TRUE(log.ok());
  const std::size_t bad_sync = recording.Find("FRAME_LEFT", 1), bad_pixel = recording.Find("FRAME_RIGHT", 2);
  Patch(log->entries()[bad_sync].offset, "bad!");
  Patch(log->entries()[bad_pixel + 1].offset - 1, "x");
  const auto before = fs::last_write_time(Path("a.log"));
  const Output output = Call("repair a.log --out b.log");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("an event with a bad sync word"));
  EXPECT_THAT(output.text, HasSubstr("FRAME_RIGHT: a message of 665 bytes has a wrong CRC-32"));
  EXPECT_THAT(output.text,
              HasSubstr("b.log: 13 events and a new closing event; left out: 1 events, 1 damaged"));
  EXPECT_EQ(fs::last_write_time(Path("a.log")), before);
  const auto repaired = LogReader::Open(Path("b.log"));
  ASSERT_TRUE(repaired.ok());
  std::size_t at = 0;
  for (std::size_t i = 0; i + 1 < recording.events.size(); ++i) {
    if (i == bad_sync || i == bad_pixel) continue;
    const LogEntry& entry = repaired->entries()[at++];
    EXPECT_EQ(repaired->ChannelOf(entry), recording.events[i].channel);
    EXPECT_EQ(entry.utime, recording.events[i].utime);
    EXPECT_EQ(*repaired->Read(entry), recording.events[i].message);
  }
  const Output check = Call("check b.log");  // it is whole, and says that it is not complete
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_THAT(check.text, HasSubstr("FRAME_LEFT: the closing event names a gap"));
  EXPECT_THAT(check.text, HasSubstr("of a.log were damaged: an event with a bad sync word"));
  EXPECT_EQ(check.text.find("closing event counts"), std::string::npos) << check.text;
  EXPECT_NE(Call("repair a.log --out b.log").exit_code, 0);  // never over an existing one
  EXPECT_NE(Call("repair a.log --out a.log").exit_code, 0);
}

TEST_F(LogCli, CutTakesWhatIsAskedFor) {
  Write(TestRecording::Make());
  ASSERT_EQ(Call("cut a.log --out view.log --view 1").exit_code, 0);
  EXPECT_EQ(Channels("view.log"),
            (std::vector<std::string>{"RECORDING_OPENED", "RECORDED_FILE", "FRAME_LEFT", "FRAME_RIGHT",
                                      "VIEW_CLOUD", "RECORDING_CLOSED"}));
  ASSERT_EQ(Call("cut a.log --out frames.log --channel 'FRAME_.*' VERDICT --part 7").exit_code, 0);
  EXPECT_EQ(Channels("frames.log").size(), 2u + 7 + 1);
  ASSERT_EQ(Call("cut a.log --out early.log --from +0.2 --to 1700000000500000").exit_code, 0);
  EXPECT_EQ(Channels("early.log"),
            (std::vector<std::string>{"RECORDING_OPENED", "RECORDED_FILE", "FRAME_LEFT", "FRAME_RIGHT",
                                      "VIEW_CLOUD", "SERVICE_STATE", "RECORDING_CLOSED"}));
  EXPECT_THAT(Call("check early.log").text, HasSubstr("9 events were left out on request"));
  ASSERT_EQ(Call("cut a.log --out all.log").exit_code, 0);
  EXPECT_EQ(Call("check all.log").exit_code, 0);
}

TEST_F(LogCli, CutRefusesWhatItCannotDo) {
  Write(TestRecording::Make());
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"--from yesterday", "\"yesterday\" is no time"},
      {"--to +", "\"+\" is no time"},
      {"--to +nan", "is no time"},
      {"--from 12x", "is no time"},
      {"--channel '('", "is no regular expression"},
      {"--part 8", "none of its 16 events"},
      {"--from +100", "none of its 16 events"}};
  for (const auto& [option, sentence] : wrong) {
    const Output output = Call("cut a.log --out b.log " + option);
    EXPECT_EQ(output.exit_code, 1) << option;
    EXPECT_THAT(output.text, HasSubstr(sentence));
  }
  EXPECT_EQ(Files("."), std::vector<std::string>{"a.log"});
}

TEST_F(LogCli, ExportMakesFilesOfEverything) {
  const TestRecording recording = TestRecording::Make();
  Write(recording);
  const Output output = Call("export a.log --out b/");
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

TEST_F(LogCli, ExportSaysWhatItHadToLeaveOut) {
  TestRecording recording = TestRecording::Make();
  recording.events[recording.Find("VIEW_CLOUD", 1)].message.back() ^= 1;
  Write(recording);
  const Output output = Call("export a.log --out b");
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

TEST_F(LogCli, ExportsToMcap) {
  Write(TestRecording::Make());
  const Output output = Call("export a.log --mcap b.mcap");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_EQ(output.text, "b.mcap: 16 messages\n");
  EXPECT_THAT(Call("export a.log --mcap b.mcap").text, HasSubstr("b.mcap: exists already"));
  EXPECT_EQ(Files("."), (std::vector<std::string>{"a.log", "b.mcap"}));
}

}  // namespace
}  // namespace forgescan
