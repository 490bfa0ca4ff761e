// The recorder as a process on the real bus: with buffers that lose nearly every image, stopped, killed, held
// still, and on a disk that refuses.
#include "tests/services/recorder/recorder_process.h"

#include <gmock/gmock.h>

#include <csignal>
#include <fstream>

#include "services/common/bus/stream_header.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kSmallBuffer = 106'496;  // the kernel makes 212992 of it: hardly an image arrives whole
constexpr int kLargeBuffer = 104'857'600;
constexpr std::size_t kImage = 5'013'504;
constexpr double kPatience_s = 90;

// The recording of a part, which has to be the only one and whole.
void ExpectWhole(const std::vector<Recording>& recordings, int part, const LineScript& line) {
  const auto parts = OfPart(recordings, part);
  ASSERT_EQ(parts.size(), 1u);
  ASSERT_TRUE(parts[0].closed.has_value());
  for (const fsmsg::recording_gap_t& gap : parts[0].closed->gaps) {
    ADD_FAILURE() << gap.channel << " " << gap.first_sequence << ": " << gap.reason;
  }
  std::size_t held = 0;
  for (const LogEvent& event : parts[0].events) {
    const bool state = event.channel.ends_with("_STATE") || event.channel.starts_with("RECORD");
    held += state ? 0 : 1;
  }
  EXPECT_EQ(held, line.SaidOf(part));
  for (const char* channel : {"FRAME_LEFT", "FRAME_RIGHT"}) {
    for (const Bytes& message : parts[0].On(channel)) {
      EXPECT_TRUE(CheckStreamHeader(message).ok()) << channel;
    }
  }
}

TEST_F(RecorderProcess, IsCompleteThroughBuffersThatLoseNearlyEveryImage) {
  MakeStation(kSmallBuffer);
  Start();
  LineScript line(*hub_, kImage);
  line.Part(7, 2, Pause());
  ASSERT_TRUE(RunUntil([this] { return Counter("parts_complete") == 1; }, kPatience_s));
  EXPECT_GT(service_->messages_recovered, 0);
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  ExpectWhole(Recordings(), 7, line);
}

TEST_F(RecorderProcess, StoppedRightAfterThePartWasSortedItsRecordingIsWhole) {
  MakeStation(kLargeBuffer);
  Start();
  LineScript line(*hub_, kImage);
  line.Part(7, 4, Pause());
  Run(0.05);  // the last words of the line are on their way
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  ExpectWhole(Recordings(), 7, line);
}

TEST_F(RecorderProcess, StoppedInTheMiddleOfAPartItSaysSo) {
  MakeStation(kLargeBuffer);
  Start();
  LineScript line(*hub_, 1000);
  line.Begin(7, Pause());
  line.View(7, 0, Pause());
  Run(1);
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  const auto parts = OfPart(Recordings(), 7);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_THAT(parts[0].path, HasSubstr("_NO_VERDICT_INCOMPLETE"));
  ASSERT_TRUE(parts[0].closed.has_value());
  ASSERT_EQ(parts[0].closed->gaps.size(), 1u);
  EXPECT_THAT(parts[0].closed->gaps[0].reason, HasSubstr("stopped before the part was finished"));
  EXPECT_EQ(parts[0].On("FRAME_LEFT").size(), 2u);
}

TEST_F(RecorderProcess, KilledItLeavesWhatItHadAndTheNextOneDoesNotTouchIt) {
  MakeStation(kLargeBuffer);
  Start();
  LineScript line(*hub_, 100'000);
  line.Begin(7, Pause());
  line.View(7, 0, Pause());
  Run(1);
  Signal(SIGKILL);
  EXPECT_EQ(WaitForEnd(), 128 + SIGKILL);
  const auto left = OfPart(Recordings(), 7);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_THAT(left[0].path, HasSubstr(".lcmlog.part"));
  EXPECT_EQ(left[0].On("FRAME_LEFT").size(), 2u) << "all but its end is readable";
  const auto left_bytes = fs::file_size(left[0].path);

  Start();
  ASSERT_TRUE(RunUntil([this] { return Counter("recordings_left_open") == 2; }, 5)) << "part and station";
  line.View(7, 1, Pause());
  line.End(7, Pause(), 1);
  line.Part(8, 1, Pause());
  ASSERT_TRUE(RunUntil([this] { return Counter("parts_complete") == 1; }, kPatience_s));
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  EXPECT_EQ(fs::file_size(left[0].path), left_bytes);
  const auto recordings = Recordings();
  ExpectWhole(recordings, 8, line);
  const auto parts = OfPart(recordings, 7);
  ASSERT_EQ(parts.size(), 2u);
  ASSERT_TRUE(parts[1].closed.has_value());
  EXPECT_EQ(parts[1].closed->gaps[0].channel, "PART_ARRIVED")
      << "the rest of the part says that it is a rest";
}

TEST_F(RecorderProcess, ADiskThatRefusesStopsRecordingLoudlyAndTheNextPartIsRecorded) {
  MakeStation(kLargeBuffer);
  Start(3'000'000);
  LineScript line(*hub_, 1'000'000);
  line.Begin(7, Pause());
  line.View(7, 0, Pause());
  ASSERT_TRUE(
      RunUntil([this] { return recorder_->status == fsmsg::recorder_state_t::STATUS_STOPPED; }, kPatience_s));
  EXPECT_THAT(recorder_->reason, HasSubstr("File too large"));
  ASSERT_TRUE(RunUntil([this] { return service_->state == fsmsg::service_state_t::STATE_ERROR; }, 5));
  LimitFiles(RLIM_INFINITY);
  line.End(7, Pause(), 1);
  ASSERT_TRUE(RunUntil([this] { return recorder_->status == fsmsg::recorder_state_t::STATUS_RECORDING; },
                       kPatience_s));
  line.Part(8, 1, Pause());
  ASSERT_TRUE(RunUntil([this] { return Counter("parts_complete") == 1; }, kPatience_s));
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  const auto recordings = Recordings();
  ExpectWhole(recordings, 8, line);
  const auto broken = OfPart(recordings, 7);
  ASSERT_EQ(broken.size(), 1u);
  EXPECT_FALSE(broken[0].closed.has_value());
  EXPECT_EQ(broken[0].On("FRAME_LEFT").size() + broken[0].On("FRAME_RIGHT").size(), 2u);
  EXPECT_LT(fs::file_size(broken[0].path), 3'000'000u);
}

TEST_F(RecorderProcess, HeldStillForSecondsItMissesNothing) {
  MakeStation(kSmallBuffer);
  Start();
  LineScript line(*hub_, 1'000'000);
  line.Begin(7, Pause());
  Signal(SIGSTOP);
  line.View(7, 0, Pause());
  line.View(7, 1, Pause());
  Run(3);
  Signal(SIGCONT);
  line.End(7, Pause(), 1);
  ASSERT_TRUE(RunUntil([this] { return Counter("parts_complete") == 1; }, kPatience_s));
  EXPECT_GT(service_->messages_recovered, 0);
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  ExpectWhole(Recordings(), 7, line);
}

// As on the line: a frame of one camera every 43.2 ms.
TEST_F(RecorderProcess, AtFullRateAmongOtherSubscribersAndBusyProcessesItMissesNothing) {
  constexpr std::int64_t kFramePeriodUs = 43'200;
  constexpr int kViews = 6;
  for (int i = 0; i < 3; ++i) {
    StartFrameSubscriber(kLargeBuffer);
  }
  StartBusyProcess();
  StartBusyProcess();
  MakeStation(kLargeBuffer);
  Start();
  LineScript line(*hub_, kImage);
  std::size_t said = 0;
  std::int64_t due_us = bus_->NowUs();
  line.Part(7, kViews, [&] {
    const bool frame = line.said().size() > said && line.said().back().channel.starts_with("FRAME");
    said = line.said().size();
    due_us = std::max(due_us, bus_->NowUs()) + (frame ? kFramePeriodUs : 0);
    RunUntil([&] { return bus_->NowUs() >= due_us; }, 1);
  });
  ASSERT_TRUE(RunUntil([this] { return Counter("parts_complete") == 1; }, kPatience_s));
  EXPECT_EQ(service_->messages_missing, 0);
  RecordProperty("recovered", static_cast<int>(service_->messages_recovered));
  Signal(SIGTERM);
  EXPECT_EQ(WaitForEnd(), 0);
  ExpectWhole(Recordings(), 7, line);
}

TEST_F(RecorderProcess, AFileOfTheStationThatIsTooLargeIsRefusedAtTheStart) {
  MakeStation(kLargeBuffer);
  fs::resize_file(base_ / "station/a.bundle", 60'000'001);
  EXPECT_EQ(std::system((std::string(FORGESCAN_BIN_DIR) + "/forgescan-recorder --station " +
                         (base_ / "station").string() + " 2>" + (base_ / "recorder.log").string())
                            .c_str()),
            256);
  std::ifstream log(base_ / "recorder.log");
  const std::string text{std::istreambuf_iterator<char>(log), {}};
  EXPECT_THAT(text, HasSubstr("a.bundle: has 60000001 bytes; a recording takes files of at most 60000000"));
}

}  // namespace
}  // namespace forgescan::testing
