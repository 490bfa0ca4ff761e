#include "services/camera/frame_pairing.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace forgescan {
namespace {

constexpr std::int64_t kPeriod_us = 82'000;
constexpr std::int64_t kOffset_us = 7'654'321;  // camera clock - controller clock; the pairing is not told
constexpr std::int64_t kDeadline_us = 200'000;  // after the pulse, on the controller's clock for simplicity

// A line whose pulses and frames the test sends or leaves out. Frames are named by the pulse that made them.
class FramePairingTest : public testing::Test {
 protected:
  std::int64_t TimeOf(std::int64_t pulse) const { return pulse * kPeriod_us + view_ * 1'000'000; }
  void Pulse(std::int64_t pulse) {
    Note(pairing_.OnPulse({view_, pulse, TimeOf(pulse), TimeOf(pulse) + kDeadline_us}));
  }
  void Frame(std::int64_t pulse, std::uint64_t id, bool complete = true) {
    Note(pairing_.OnFrame({static_cast<std::uint64_t>(pulse), id, TimeOf(pulse) + kOffset_us + jitter_us_,
                           complete, TimeOf(pulse) + 50'000}));
  }
  void Advance(std::int64_t after_pulse) { Note(pairing_.AdvanceTo(TimeOf(after_pulse) + kDeadline_us)); }
  // "P3=3" pulse 3 has frame 3; M missing, I incomplete, X contradiction, D duplicate, L late, S stray.
  void Note(const std::vector<PairingAction>& actions) {
    for (const PairingAction& action : actions) {
      log_ += fmt::format("{}{}{}", log_.empty() ? "" : " ",
                          "PMIXDLS"[static_cast<std::size_t>(action.verdict)], action.pulse);
      log_ += action.handle ? fmt::format("={}", *action.handle) : "";
    }
  }
  std::string Log() { return std::exchange(log_, {}); }

  FramePairing pairing_{FramePairingOptions{}};
  std::int64_t view_ = 1;
  std::int64_t jitter_us_ = 0;
  std::string log_;
};

TEST_F(FramePairingTest, Starts) {
  EXPECT_TRUE(FramePairingOptions{}.Check().ok());
  EXPECT_FALSE(pairing_.anchored());
  EXPECT_TRUE(pairing_.AdvanceTo(1'000'000).empty());
}

TEST_F(FramePairingTest, EachFrameFindsItsPulseWhicheverComesFirst) {
  Pulse(1);
  Frame(1, 1);
  Frame(2, 2);  // before its record
  Pulse(2);
  Pulse(3);
  Pulse(4);
  Frame(4, 4);  // out of order
  Frame(3, 3);
  EXPECT_EQ(Log(), "P1=1 P2=2 P4=4 P3=3");
  Advance(10);
  EXPECT_EQ(Log(), "");
}

TEST_F(FramePairingTest, LostFirstFrameIsFoundByItsId) {
  Pulse(1);
  Pulse(2);
  Frame(2, 2);
  Pulse(3);
  Frame(3, 3);
  EXPECT_EQ(Log(), "P2=2 P3=3");
  Advance(1);
  EXPECT_EQ(Log(), "M1");
}

TEST_F(FramePairingTest, LostFrameInTheMiddleAndThenALateOne) {
  for (int pulse = 1; pulse <= 4; ++pulse) {
    Pulse(pulse);
  }
  Frame(1, 1);
  Frame(3, 3);
  Frame(4, 4);
  Advance(4);
  EXPECT_EQ(Log(), "P1=1 P3=3 P4=4 M2");
  Frame(2, 2);
  EXPECT_EQ(Log(), "L2=2");
}

TEST_F(FramePairingTest, LostTriggerUsesNoIdAndIsFoundByTime) {
  for (int pulse = 1; pulse <= 4; ++pulse) {
    Pulse(pulse);
  }
  Frame(1, 1);
  Frame(3, 2);
  Frame(4, 3);
  Advance(4);
  EXPECT_EQ(Log(), "P1=1 P3=3 P4=4 M2");
}

TEST_F(FramePairingTest, DuplicateIsNotPublishedTwice) {
  Pulse(1);
  Frame(1, 1);
  Frame(1, 1);
  EXPECT_EQ(Log(), "P1=1 D1=1");
}

TEST_F(FramePairingTest, CameraStartedAgainCountsFrom1) {
  Pulse(1);
  Frame(1, 1);
  pairing_.OnCameraStarted();
  EXPECT_FALSE(pairing_.anchored());
  jitter_us_ = -5'000'000;  // another clock
  view_ = 2;
  Pulse(2);
  Frame(2, 1);
  EXPECT_EQ(Log(), "P1=1 P2=2");
}

TEST_F(FramePairingTest, IdAfter65535Is1) {
  FramePairing& pairing = pairing_;
  std::int64_t pulse = 1;
  for (; pulse <= 65537; ++pulse) {
    const std::int64_t t_us = pulse * kPeriod_us;
    const auto none = pairing.OnPulse({pulse / 8, pulse, t_us, t_us + kDeadline_us});
    EXPECT_TRUE(none.empty());
    const std::uint64_t id = static_cast<std::uint64_t>((pulse - 1) % 65535 + 1);
    const auto actions =
        pairing.OnFrame({static_cast<std::uint64_t>(pulse), id, t_us + kOffset_us, true, t_us});
    ASSERT_EQ(actions.size(), 1U) << pulse;
    ASSERT_EQ(actions[0].verdict, PairingVerdict::kPaired) << pulse;
    ASSERT_EQ(actions[0].pulse, pulse);
  }
}

TEST_F(FramePairingTest, IncompleteFrameLeavesThePulseWithout) {
  Pulse(1);
  Pulse(2);
  Frame(1, 1, false);
  Frame(2, 2);
  EXPECT_EQ(Log(), "I1=1 P2=2");
  Advance(10);
  EXPECT_EQ(Log(), "");
}

TEST_F(FramePairingTest, FrameWithoutIdIsStray) {
  Pulse(1);
  Frame(1, 0, false);
  EXPECT_EQ(Log(), "S0=1");
  Advance(1);
  EXPECT_EQ(Log(), "M1");
}

TEST_F(FramePairingTest, FrameOfNoPulseIsStrayAfterItsPatience) {
  Pulse(1);
  Frame(1, 1);
  Frame(2, 2);  // no record ever
  EXPECT_EQ(Log(), "P1=1");
  Advance(20);
  EXPECT_EQ(Log(), "S0=2");
}

TEST_F(FramePairingTest, MoreIdsThanPulsesIsAContradiction) {
  Pulse(1);
  Pulse(2);
  Frame(1, 1);
  Frame(2, 5);  // the camera exposed three edges that nobody sent
  EXPECT_EQ(Log(), "P1=1 X2=2");
}

// The camera misses the very first edge: the ids say pulse 1, which is wrong, but the view is void by its
// last pulse, and the next view is right again.
TEST_F(FramePairingTest, WrongFirstAnchorVoidsItsViewAndIsForgotten) {
  for (int pulse = 1; pulse <= 3; ++pulse) {
    Pulse(pulse);
  }
  Frame(2, 1);
  Frame(3, 2);
  Advance(3);
  EXPECT_EQ(Log(), "P1=2 P2=3 M3");
  view_ = 2;
  for (int pulse = 4; pulse <= 6; ++pulse) {
    Pulse(pulse);
    Frame(pulse, static_cast<std::uint64_t>(pulse - 1));
  }
  EXPECT_EQ(Log(), "P4=4 P5=5 P6=6");
  view_ = 3;  // confirmed now: the same miss is found by time
  for (int pulse = 7; pulse <= 9; ++pulse) {
    Pulse(pulse);
  }
  Frame(8, 6);
  Frame(9, 7);
  Advance(9);
  EXPECT_EQ(Log(), "P8=8 P9=9 M7");
}

TEST_F(FramePairingTest, DriftWithinItsBoundIsFollowedAndAJumpIsNot) {
  Pulse(1);
  Frame(1, 1);
  for (int pulse = 2; pulse <= 50; ++pulse) {
    Pulse(pulse);
    jitter_us_ += 8;  // 100 ppm of 82 ms
    Frame(pulse, static_cast<std::uint64_t>(pulse));
  }
  Log();
  Pulse(51);
  jitter_us_ += 1000;  // more than the tolerance of 300 us
  Frame(51, 51);
  EXPECT_EQ(Log(), "");
  Advance(51);
  EXPECT_EQ(Log(), "M51");
}

TEST_F(FramePairingTest, OptionsOutOfRangeAreRefused) {
  FramePairingOptions options;
  options.max_window_us = 10;
  EXPECT_EQ(options.Check().error().code, ErrorCode::kInvalidArgument);
  options = {};
  options.drift_ppm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(options.Check().error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan
