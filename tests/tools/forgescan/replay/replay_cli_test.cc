// forgescan replay and forgescan play as a user or a script calls them, on the recording of logs/sample.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>

#include "services/common/log/log_reader.h"
#include "tests/run_command.h"
#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::TestFolder;

constexpr const char* kSample = FORGESCAN_SOURCE_DIR "/logs/sample/axle.lcmlog";
constexpr const char* kPlay = "play --speed 100 --bus 'udpm://239.255.76.67:7681?ttl=0' ";

struct Event {
  std::string channel;
  std::int64_t utime = 0;
  Bytes message;
};

class ReplayCli : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directory(Scratch()); }
  // Whatever a command had to say, it leaves nothing in the folder for temporary files.
  void TearDown() override { EXPECT_TRUE(fs::is_empty(Scratch())); }

  CommandOutput Call(const std::string& arguments) const {
    const std::string command = "cd " + folder_.path().string() + " && TMPDIR=" + Scratch() + " " +
                                FORGESCAN_BIN_DIR + "/forgescan " + arguments;
    return RunCommand(command);
  }
  std::string Scratch() const { return folder_ / "scratch"; }

  // The sample with changed events, as changed.lcmlog.
  void Change(const std::function<void(std::vector<Event>&)>& change) const {
    const auto log = LogReader::Open(kSample);
    ASSERT_TRUE(log.ok()) << log.error().message;
    std::vector<Event> events;
    for (const LogEntry& entry : log->entries()) {
      events.push_back({log->ChannelOf(entry), entry.utime, *log->Read(entry)});
    }
    change(events);
    auto writer = LogWriter::Create(folder_ / "changed.lcmlog");
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (const Event& event : events) {
      ASSERT_TRUE(writer->Write(event.channel, event.utime, event.message).ok());
    }
    ASSERT_TRUE(writer->Close().ok());
  }
  static Event& First(std::vector<Event>& events, const std::string& channel) {
    const auto found = std::find_if(events.begin(), events.end(),
                                    [&channel](const auto& event) { return event.channel == channel; });
    EXPECT_NE(found, events.end()) << channel;
    return *found;
  }
  void ExpectRefused(const std::string& arguments, const std::string& why) const {
    const CommandOutput output = Call(arguments);
    EXPECT_EQ(output.exit_code, 1) << output.text;
    EXPECT_THAT(output.text, HasSubstr(why)) << arguments;
    EXPECT_THAT(output.text, Not(HasSubstr("verdicts change"))) << "it computes nothing";
  }
  std::string Text(const std::string& name) const {
    std::ifstream stream(folder_ / name);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  const TestFolder folder_;
  const std::string sample_ = std::string(" ") + kSample;
};

TEST_F(ReplayCli, ReplaysTheSampleAndKeepsItsReports) {
  const CommandOutput output = Call("replay --service report --results kept" + sample_);
  EXPECT_EQ(output.exit_code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("VERDICT                   1          0        0      0"));
  EXPECT_TRUE(fs::exists(folder_ / "kept/history.sqlite"));
}

TEST_F(ReplayCli, AChangedSettingGivesVerdictsAndAPage) {
  const CommandOutput output =
      Call("replay --service report --set report.deviation_scale_mm=0.25 --report page.html" + sample_);
  EXPECT_EQ(output.exit_code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("changed: report.deviation_scale_mm = 0.25"));
  EXPECT_THAT(output.text, HasSubstr("0 of 1 verdicts change"));
  EXPECT_THAT(Text("page.html"), HasSubstr("0 of 1 verdicts change"));
  EXPECT_THAT(Text("page.html"), Not(HasSubstr("not whole")));
}

TEST_F(ReplayCli, RefusesAChangeThatChangesNothing) {
  ExpectRefused("replay --set 'fusion.x={}'" + sample_, "--set fusion.x={}: gives 0 values");
  ExpectRefused("replay --set '#a.b=1'" + sample_, "--set #a.b=1: ");
  ExpectRefused("replay --set 'report.uncertainty={a=1,b=2}'" + sample_, "gives 2 values");
  ExpectRefused("replay --set cooling.setpoint_degc=20" + sample_,
                "nothing that is computed here reads [cooling]");
  ExpectRefused("replay --service report --set fusion.view_timeout_s=61" + sample_, "reads [fusion]");
  ExpectRefused("replay --service fusion --report page.html" + sample_, "--report compares verdicts");
  EXPECT_FALSE(fs::exists(folder_ / "page.html"));
}

TEST_F(ReplayCli, SaysThatNoVerdictsAreComputedWithoutTheReport) {
  const CommandOutput output = Call("replay --service fusion --set fusion.view_timeout_s=61" + sample_);
  EXPECT_EQ(output.exit_code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("no verdicts are computed"));
  EXPECT_THAT(output.text, Not(HasSubstr("none")));
}

TEST_F(ReplayCli, ARecordingThatLacksAMessageIsNotWhole) {
  Change([](auto& events) {
    std::erase_if(events, [](const auto& event) { return event.channel == "PART_SORTED"; });
  });
  const CommandOutput output = Call("replay --service report changed.lcmlog");
  EXPECT_EQ(output.exit_code, 1) << output.text;
  EXPECT_THAT(output.text, HasSubstr("recording: changed.lcmlog: PART_SORTED the closing event counts"));
  EXPECT_THAT(output.text, HasSubstr("what there is replays equally, but the recording is not whole"));
  const CommandOutput what_if =
      Call("replay --service report --set report.deviation_scale_mm=0.25 --report page.html changed.lcmlog");
  EXPECT_EQ(what_if.exit_code, 1) << what_if.text;
  EXPECT_THAT(what_if.text, HasSubstr("the recording is not whole"));
  EXPECT_THAT(Text("page.html"), HasSubstr("PART_SORTED the closing event counts"));
}

TEST_F(ReplayCli, AWrongBitInAResultIsNamedByReplayAndLeftOutByPlay) {
  Change([](auto& events) { First(events, "VERDICT").message.back() ^= 1; });
  for (const char* options : {"", "--report page.html "}) {
    const CommandOutput output = Call(std::string("replay --service report ") + options + "changed.lcmlog");
    EXPECT_EQ(output.exit_code, 1) << output.text;
    EXPECT_THAT(output.text, HasSubstr("changed input: changed.lcmlog, event"));
    EXPECT_THAT(output.text, HasSubstr("VERDICT                   0          1        0      0"));
    EXPECT_THAT(output.text, HasSubstr("1 recorded messages are not as they were sent"));
  }
  const CommandOutput played =
      Call(std::string(kPlay) + "--channel VERDICT --channel PART_SORTED changed.lcmlog");
  EXPECT_EQ(played.exit_code, 1) << played.text;
  EXPECT_THAT(played.text, HasSubstr("left out: changed.lcmlog, event"));
  EXPECT_THAT(played.text, HasSubstr("1 messages played"));
}

TEST_F(ReplayCli, AWrongBitInAFileOfTheStationIsNamed) {
  Change([](auto& events) { First(events, "RECORDED_FILE").message.back() ^= 1; });
  const CommandOutput output = Call("replay --service report changed.lcmlog");
  EXPECT_EQ(output.exit_code, 1) << output.text;
  EXPECT_THAT(output.text, HasSubstr("RECORDED_FILE station.toml has the CRC-32"));
}

TEST_F(ReplayCli, AWrongBitInATimeIsNamedAndNotWaitedFor) {
  Change([](auto& events) { First(events, "SCAN_COMPLETE").utime ^= std::int64_t{1} << 52; });
  const CommandOutput output = Call("replay --service report changed.lcmlog");
  EXPECT_EQ(output.exit_code, 1) << output.text;
  EXPECT_THAT(output.text, HasSubstr("is minutes off"));
  EXPECT_THAT(output.text, HasSubstr("VERDICT                   1          0        0      0"));
}

TEST_F(ReplayCli, SaysWhetherARecordingIsCutOffOrHoldsNoResult) {
  Change([](auto& events) {
    const Event& verdict = First(events, "VERDICT");
    events.erase(events.begin() + (&verdict - events.data()), events.end());
  });
  const CommandOutput cut = Call("replay --service registration --service report changed.lcmlog");
  EXPECT_EQ(cut.exit_code, 1) << cut.text;
  EXPECT_THAT(cut.text, HasSubstr("what there is replays equally, but the recording is not whole"));
  const CommandOutput nothing = Call("replay --service report changed.lcmlog");
  EXPECT_EQ(nothing.exit_code, 1) << nothing.text;
  EXPECT_THAT(nothing.text, HasSubstr("there is nothing to compare"));
}

TEST_F(ReplayCli, RefusesTheSameRecordingTwice) {
  ExpectRefused("replay --service report" + sample_ + sample_, "give each recording once");
}

TEST_F(ReplayCli, AnInterruptedReplayLeavesNothingBehind) {  // TearDown() looks
  const pid_t pid = fork();
  if (pid == 0) {
    sigset_t term;  // waits for the program from its beginning on
    sigemptyset(&term);
    sigaddset(&term, SIGTERM);
    sigprocmask(SIG_BLOCK, &term, nullptr);
    raise(SIGTERM);
    setenv("TMPDIR", Scratch().c_str(), 1);
    execl(FORGESCAN_BIN_DIR "/forgescan", "forgescan", "replay", kSample, nullptr);
    _exit(127);
  }
  int status = 0;
  ASSERT_EQ(waitpid(pid, &status, 0), pid);
  ASSERT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), 1);
}

TEST_F(ReplayCli, PlaysWhatIsAskedForOrSaysThatItIsNotThere) {
  const CommandOutput played = Call(std::string(kPlay) + "--channel VERDICT" + sample_);
  EXPECT_EQ(played.exit_code, 0) << played.text;
  EXPECT_THAT(played.text, HasSubstr("1 messages played"));
  ExpectRefused(std::string(kPlay) + "--channel NOSUCH" + sample_,
                "--channel NOSUCH: the recording holds no message");
  ExpectRefused(std::string(kPlay) + "--channel VERDICT --without VERDICT" + sample_,
                "there is nothing to play");
}

}  // namespace
}  // namespace forgescan
