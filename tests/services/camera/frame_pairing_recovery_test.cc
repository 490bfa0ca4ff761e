// What comes after a clock, the controller or the trigger service was started again: at most two views are
// void, none is complete and wrong, and then all are whole again.
#include <gtest/gtest.h>

#include <map>

#include "services/camera/frame_pairing.h"

namespace forgescan {
namespace {

constexpr std::int64_t kPeriodUs = 82'000;
constexpr std::int64_t kPauseUs = 2'000'000;  // between two views
constexpr std::int64_t kDeadlineUs = 500'000;
constexpr std::int64_t kWireUs = 55'000;  // from the edge to the arrival of the image
constexpr int kPulses = 8;

// Station time runs; the clocks of camera and controller are that time plus an offset a test may shift.
class FramePairingRecoveryTest : public testing::Test {
 protected:
  struct Outcome {
    int right = 0;
    int wrong = 0;
    int stray = 0;
  };

  void Note(const std::vector<PairingAction>& actions) {
    for (const PairingAction& action : actions) {
      if (action.verdict == PairingVerdict::kPaired) {
        ++(*action.handle == action.record ? outcome_.right : outcome_.wrong);
      }
      outcome_.stray += action.verdict == PairingVerdict::kStray ? 1 : 0;
      settled_[action.record] += action.verdict <= PairingVerdict::kContradiction ? 1 : 0;
    }
  }
  // Records and frames are both named by the edge they belong to.
  void Pulse(std::uint64_t edge) {
    Note(pairing_.OnPulse(
        {view_, ++pulse_, now_us_ + controller_offset_us_, now_us_ + kDeadlineUs, now_us_, edge}));
  }
  void Frame(std::uint64_t edge, std::int64_t exposed_us) {
    id_ = id_ % 65535 + 1;
    Note(pairing_.OnFrame({edge, id_, exposed_us + camera_offset_us_, true, exposed_us + kWireUs}));
  }
  Outcome View(std::int64_t pause_us = kPauseUs, int lost_frame = 0) {
    outcome_ = {};
    ++view_;
    for (int i = 1; i <= kPulses; ++i) {
      Pulse(++edge_);
      if (i != lost_frame) {
        Frame(edge_, now_us_);
      } else {
        id_ = id_ % 65535 + 1;  // exposed, lost on the wire
      }
      now_us_ += kPeriodUs;
      Note(pairing_.AdvanceTo(now_us_));
    }
    now_us_ += pause_us;
    Note(pairing_.AdvanceTo(now_us_));
    return outcome_;
  }
  void ExpectWhole(const Outcome& outcome) {
    EXPECT_EQ(outcome.right, kPulses);
    EXPECT_EQ(outcome.wrong, 0);
  }
  // Views until one is whole; no view before it is complete.
  int ViewsLostUntilWhole(std::int64_t pause_us = kPauseUs) {
    for (int lost = 0; lost < 10; ++lost) {
      const Outcome outcome = View(pause_us);
      if (outcome.right == kPulses) {
        return lost;
      }
      EXPECT_LT(outcome.right + outcome.wrong, kPulses);
    }
    return 10;
  }

  FramePairing pairing_{FramePairingOptions{}};
  std::map<std::uint64_t, int> settled_;  // verdicts a pulse got
  Outcome outcome_;
  std::int64_t now_us_ = 1'000'000'000;
  std::int64_t controller_offset_us_ = -900'000'000;
  std::int64_t camera_offset_us_ = 7'654'321;
  std::int64_t view_ = 0;
  std::int64_t pulse_ = 0;
  std::uint64_t edge_ = 0;
  std::uint64_t id_ = 0;
};

TEST_F(FramePairingRecoveryTest, LongPauseWithDriftCostsNoView) {
  ExpectWhole(View());
  ExpectWhole(View(600 * 1'000'000LL));
  camera_offset_us_ += 60'000;  // 100 ppm of 600 s
  ExpectWhole(View());
  ExpectWhole(View());
}

TEST_F(FramePairingRecoveryTest, JumpOfAClockCostsOneView) {
  for (const std::int64_t jump_us : {20'000LL, -30'000LL, 5'000'000'000LL, -5'000'000LL}) {
    ExpectWhole(View());
    camera_offset_us_ += jump_us;
    EXPECT_LE(ViewsLostUntilWhole(), 1) << jump_us;
    ExpectWhole(View());
  }
}

// The worst jump: time finds a pulse for most frames, the wrong one.
TEST_F(FramePairingRecoveryTest, JumpByWholePeriodsCostsTwoViewsAtMost) {
  for (int periods = -7; periods <= 7; ++periods) {
    ExpectWhole(View());
    ExpectWhole(View());
    camera_offset_us_ += periods * kPeriodUs;
    EXPECT_LE(ViewsLostUntilWhole(), 2) << periods;
    ExpectWhole(View());
  }
}

TEST_F(FramePairingRecoveryTest, ControllerStartedAgainCostsNoView) {
  ExpectWhole(View());
  ExpectWhole(View());
  pulse_ = 0;
  controller_offset_us_ = -now_us_;
  ExpectWhole(View());
  ExpectWhole(View());
}

TEST_F(FramePairingRecoveryTest, ControllerStartedAgainWithinAView) {
  ExpectWhole(View());
  ++view_;
  Pulse(++edge_);
  Frame(edge_, now_us_);
  now_us_ += kPeriodUs;
  Pulse(++edge_);  // its frame never comes
  const std::uint64_t open = edge_;
  id_ = id_ % 65535 + 1;
  now_us_ += kPeriodUs;
  pulse_ = 0;
  controller_offset_us_ = -now_us_;
  EXPECT_LE(ViewsLostUntilWhole(), 1);  // the lost frame used a number
  EXPECT_EQ(settled_[open], 1);
  ExpectWhole(View());
}

// Pulse numbers that jump forward, as when the link counts on over a restart it has not noticed.
TEST_F(FramePairingRecoveryTest, PulseNumbersThatJumpForward) {
  ExpectWhole(View());
  pulse_ += 4000;
  controller_offset_us_ += 123'456'789;
  EXPECT_LE(ViewsLostUntilWhole(), 1);
}

// A retake follows at once: frames of the void view still wait when the next one begins.
TEST_F(FramePairingRecoveryTest, FramesThatStillWaitDoNotEnterTheNextView) {
  ExpectWhole(View(100'000));
  camera_offset_us_ += 50'000;
  EXPECT_LE(ViewsLostUntilWhole(100'000), 1);
  for (int i = 0; i < 5; ++i) {
    ExpectWhole(View(100'000));
  }
}

TEST_F(FramePairingRecoveryTest, OneLostFrameDoesNotEndAConfirmedOffset) {
  for (int lost = 1; lost <= kPulses; ++lost) {
    ExpectWhole(View());
    const Outcome gap = View(kPauseUs, lost);
    EXPECT_EQ(gap.right, kPulses - 1);
    EXPECT_EQ(gap.wrong, 0);
    ExpectWhole(View());
  }
}

TEST_F(FramePairingRecoveryTest, EveryPulseGetsOneVerdict) {
  for (int i = 0; i < 3; ++i) {
    View();
    pulse_ = 0;
    controller_offset_us_ = -now_us_;
    View(100'000, 3);
    camera_offset_us_ += 50'000;
    View(100'000, 8);
  }
  View();
  for (std::uint64_t edge = 1; edge <= edge_; ++edge) {
    EXPECT_EQ(settled_[edge], 1) << edge;
  }
}

}  // namespace
}  // namespace forgescan
