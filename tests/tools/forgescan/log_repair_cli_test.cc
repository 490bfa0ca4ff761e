// forgescan log repair, as a user calls it.
#include "tests/tools/forgescan/log_cli.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST_F(LogCli, RepairKeepsWhatIsUndamagedAndSaysWhatIsNot) {
  const TestRecording recording = TestRecording::Make();
  Write(recording);
  const auto log = LogReader::Open(Path("a.log"));
  ASSERT_TRUE(log.ok());
  const std::size_t bad_sync = recording.Find("FRAME_LEFT", 1), bad_pixel = recording.Find("FRAME_RIGHT", 2);
  Patch(log->entries()[bad_sync].offset, "bad!");
  Patch(log->entries()[bad_pixel + 1].offset - 1, "x");
  const auto before = fs::last_write_time(Path("a.log"));
  const CommandOutput output = Call("repair a.log --out b.log");
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
  const CommandOutput check = Call("check b.log");  // it is whole, and says that it is not complete
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_THAT(check.text, HasSubstr("FRAME_LEFT: the closing event names a gap"));
  EXPECT_THAT(check.text, HasSubstr("of a.log were damaged: an event with a bad sync word"));
  EXPECT_EQ(check.text.find("closing event counts"), std::string::npos) << check.text;
  EXPECT_NE(Call("repair a.log --out b.log").exit_code, 0);  // never over an existing one
  EXPECT_NE(Call("repair a.log --out a.log").exit_code, 0);
}

// What a recorder that died has left, under the name it would have got.
TEST_F(LogCli, RepairGivesALeftOverItsName) {
  TestRecording recording = TestRecording::Make();
  recording.events.pop_back();
  Write(recording);
  fs::rename(Path("a.log"), Path("b.log.part"));
  const CommandOutput output = Call("repair b.log.part --out b.log");
  ASSERT_EQ(output.exit_code, 0) << output.text;
  EXPECT_EQ(Files("."), (std::vector<std::string>{"b.log", "b.log.part"}));
  const CommandOutput check = Call("check b.log");
  EXPECT_THAT(check.text, HasSubstr("b.log.part has no closing event"));
  EXPECT_EQ(check.text.find("VERDICT"), std::string::npos) << check.text;
}

TEST_F(LogCli, WhatARepairLeftOutIsNamedOnceAChannelWithACount) {
  TestRecording recording = TestRecording::Make();
  recording.events.pop_back();
  for (std::size_t i = 0; i < 20'000; ++i) {
    recording.events.push_back(
        {"SERVICE_STATE", recording.Now(), recording.events[recording.Find("SERVICE_STATE")].message});
    recording.events.back().message.resize(20 + i % 10);
    recording.events.push_back({"SHORT", recording.Now(), Bytes(i % 8)});
  }
  Write(recording);
  ASSERT_EQ(Call("repair a.log --out b.log").exit_code, 0);
  const auto channels = Channels("b.log");
  EXPECT_EQ(std::count(channels.begin(), channels.end(), "SHORT"), 0);
  const CommandOutput check = Call("check b.log");
  EXPECT_THAT(check.text,
              HasSubstr("SERVICE_STATE: the closing event names a gap: 20000 messages were left out: they "
                        "do not decode as fsmsg.service_state_t"));
  EXPECT_THAT(
      check.text,
      HasSubstr("SHORT: the closing event names a gap: 20000 messages were left out: they are no LCM"));
  EXPECT_THAT(check.text, HasSubstr("3 findings in 1 of 1 logs"));
}

}  // namespace
}  // namespace forgescan
