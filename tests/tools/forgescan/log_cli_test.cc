// Looking into recordings, checking and cutting them.
#include "tests/tools/forgescan/log_cli.h"

#include <nlohmann/json.hpp>

#include "tests/common/real_data.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Json = nlohmann::json;

TEST_F(LogCli, InfoStartsWithWhatARecordingHolds) {
  Write(TestRecording::Make());
  const CommandOutput output = Call("info --json a.log a.log");
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
  const CommandOutput text = Call("info a.log");
  EXPECT_THAT(text.text, HasSubstr("recording of part 7 at station test, version 1.2.3"));
  EXPECT_THAT(text.text, HasSubstr("closed: the part was sorted; verdict OK; 0 gaps"));
}

TEST_F(LogCli, InfoOfARealLog) {
  const auto data = RealData("lcm-log");
  if (!data) GTEST_SKIP() << "lcm-log" << kNoRealData;
  const CommandOutput output = Call("info --json " + (*data / "convex.log").string());
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
  const CommandOutput output = Call("check a.log");
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

TEST_F(LogCli, CheckNamesAnEventWhoseTimeIsMinutesOff) {
  TestRecording recording = TestRecording::Make();
  recording.events[5].utime ^= std::int64_t{1} << 44;
  Write(recording);
  ExpectFinding("event 5: its time");
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
  const CommandOutput two = Call("check a.log nothing.log");
  EXPECT_EQ(two.exit_code, 1);
  EXPECT_THAT(two.text, HasSubstr("nothing.log: No such file"));
  EXPECT_THAT(two.text, HasSubstr("in 2 of 2 logs"));
}

TEST_F(LogCli, InfoAndCheckGoOnAfterALogThatCannotBeRead) {
  Write(TestRecording::Make());
  const CommandOutput text = Call("info a.log nothing.log a.log");
  EXPECT_EQ(text.exit_code, 1);
  EXPECT_THAT(text.text, HasSubstr("nothing.log: No such file"));
  const std::size_t first = text.text.find("recording of part 7");
  EXPECT_NE(text.text.find("recording of part 7", first + 1), std::string::npos) << text.text;
  const CommandOutput json = Call("info --json nothing.log a.log none.log 2>/dev/null");
  EXPECT_EQ(json.exit_code, 1);
  EXPECT_EQ(Json::parse(json.text).size(), 1u);
}

TEST_F(LogCli, WhatALogSaysDoesNotReachTheTerminalRaw) {
  TestRecording recording = TestRecording::Make();
  recording.events.pop_back();
  fsmsg::recording_gap_t gap{};
  gap.channel = "A";
  gap.reason = "gone\n\x1B[2Ja.log: whole and complete \xC3\xB6\xFF\xC2\x9B";
  recording.Close({gap});
  Write(recording);
  for (const char* command : {"info a.log", "check a.log"}) {
    const CommandOutput output = Call(command);
    EXPECT_THAT(output.text, HasSubstr("gone\\x0A\\x1B[2Ja.log: whole and complete \xC3\xB6\\xFF\\xC2\\x9B"))
        << command;
  }
}

TEST_F(LogCli, AReaderThatGoesAwayLeavesNoHalfLog) {
  TestRecording recording = TestRecording::Make();
  recording.events.pop_back();
  for (int i = 0; i < 5000; ++i) {  // more to say than a pipe holds
    recording.events.push_back({"SHORT", recording.Now(), Bytes(5)});
  }
  Write(recording);
  const std::string log = std::string(FORGESCAN_BIN_DIR) + "/forgescan log ";
  std::system(
      ("cd " + folder_.string() + " && (" + log + "repair a.log --out b.log | true) 2>/dev/null").c_str());
  EXPECT_EQ(Files("."), std::vector<std::string>{"a.log"}) << "what it had written is gone";
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
      {"--from ''", "is no time"},
      {"--from +-1", "is no time"},
      {"--from +0x1", "is no time"},
      {"--from ' 1'", "is no time"},
      {"--channel '('", "is no regular expression"},
      {"--part 8", "none of its 16 events"},
      {"--from +100", "none of its 16 events"}};
  for (const auto& [option, sentence] : wrong) {
    const CommandOutput output = Call("cut a.log --out b.log " + option);
    EXPECT_EQ(output.exit_code, 1) << option;
    EXPECT_THAT(output.text, HasSubstr(sentence));
  }
  EXPECT_EQ(Files("."), std::vector<std::string>{"a.log"});
}

}  // namespace
}  // namespace forgescan
