// The supervisor as a machine: what it does about services that end, fall silent, or never come up.
#include "tools/forgescan/station/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace forgescan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Kind = SupervisorEvent::Kind;
using Phase = Supervisor::Phase;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr int kSigKill = 9, kSigSegv = 11;

class SupervisorTest : public ::testing::Test {
 protected:
  void Do(const Supervisor::Actions& actions) {
    started_.clear();
    killed_.clear();
    events_.clear();
    for (const SupervisorAction& action : actions) {
      if (const auto* start = std::get_if<StartProcess>(&action)) {
        started_.push_back(start->service);
      } else if (const auto* kill = std::get_if<KillProcess>(&action)) {
        killed_.push_back(kill->service);
      } else {
        events_.push_back(std::get<SupervisorEvent>(action));
      }
    }
  }
  // What is started begins its session at once.
  void Tick(double at_s) {
    Do(supervisor_.OnTick(At(at_s)));
    for (const std::string& service : started_) {
      sessions_[service] = At(at_s) + 1;
    }
  }
  void Say(const std::string& service, double at_s, bool ready = true) {
    Do(supervisor_.OnWord({service, sessions_[service], false, ready}, At(at_s)));
  }
  void Crash(const std::string& service, double at_s, int signal = kSigKill) {
    Do(supervisor_.OnEnd({service, false, signal, "the last line"}, At(at_s)));
  }
  // Ends, is started again, and is ready again at once: one failure.
  void FailOnce(const std::string& service, double at_s) {
    Crash(service, at_s);
    for (double s = at_s; supervisor_.phase(service) == Phase::kWaiting; s += 0.1) {
      Tick(s);
      waited_s_ = s - at_s;
    }
  }
  void AllUp(double at_s) {
    for (const char* service : {"report", "camera", "robot"}) {
      Tick(at_s);
      Say(service, at_s);
    }
  }
  static std::int64_t At(double s) { return 1'700'000'000'000'000 + static_cast<std::int64_t>(s * 1e6); }

  std::map<std::string, std::int64_t> sessions_;
  Supervisor supervisor_{{}, {{"report", 1}, {"camera", 2}, {"robot", 3}}};
  std::vector<std::string> started_, killed_;
  std::vector<SupervisorEvent> events_;
  double waited_s_ = 0;
};

TEST_F(SupervisorTest, StartsStageByStage) {
  Tick(0);
  EXPECT_THAT(started_, ElementsAre("report"));
  Tick(1);
  EXPECT_THAT(started_, IsEmpty()) << "the report has not spoken";
  Say("report", 1.5);
  ASSERT_EQ(events_.size(), 1u);
  EXPECT_EQ(events_[0].kind, Kind::kReady);
  Tick(1.6);
  EXPECT_THAT(started_, ElementsAre("camera"));
  Do(supervisor_.OnWord({"camera", sessions_["camera"], false, false},
                        At(2)));  // degraded: there is no camera, but it works
  Tick(2.1);
  EXPECT_THAT(started_, ElementsAre("robot"));
}

TEST_F(SupervisorTest, DoesNotWaitForeverForAStage) {
  Tick(0);
  Do(supervisor_.OnWord({"report", sessions_["report"], true, false}, At(1)));  // STARTING is not up
  Tick(9.9);
  EXPECT_THAT(started_, IsEmpty());
  Tick(10.1);
  EXPECT_THAT(started_, ElementsAre("camera"));
}

TEST_F(SupervisorTest, StartsAKilledServiceAtOnceAndTellsHowLongItWasAway) {
  AllUp(0);
  Crash("camera", 5, kSigSegv);
  ASSERT_EQ(events_.size(), 1u);
  EXPECT_EQ(events_[0].kind, Kind::kCrash);
  EXPECT_EQ(events_[0].text, "was killed by signal 11: the last line");
  Tick(5);
  EXPECT_THAT(started_, ElementsAre("camera"));
  EXPECT_EQ(supervisor_.restarts("camera"), 1);
  Say("camera", 6.25);
  ASSERT_EQ(events_.size(), 1u);
  EXPECT_EQ(events_[0].text, "is ready, 1.25 s after it ended");
}

TEST_F(SupervisorTest, AnExitWithoutARequestIsAFailureToo) {
  AllUp(0);
  Do(supervisor_.OnEnd({"robot", true, 0, ""}, At(3)));
  EXPECT_EQ(events_.at(0).text, "ended with exit code 0");
  Tick(3);
  EXPECT_THAT(started_, ElementsAre("robot"));
}

TEST_F(SupervisorTest, KillsTheSilentAndStartsThemAgain) {
  AllUp(0);
  Say("report", 4);
  Say("robot", 4);
  Tick(5.0);
  EXPECT_THAT(killed_, IsEmpty()) << "5 s are allowed";
  Tick(5.1);
  EXPECT_THAT(killed_, ElementsAre("camera"));
  EXPECT_THAT(events_.at(0).text, HasSubstr("silent for 5.1 s, 5 s are allowed"));
  Say("camera", 5.2);
  Tick(5.3);
  EXPECT_THAT(killed_, IsEmpty()) << "once is enough";
  Crash("camera", 5.4);
  Tick(5.4);
  EXPECT_THAT(started_, ElementsAre("camera"));
}

TEST_F(SupervisorTest, AServiceThatLoadsItsModelMayBeSilentForLonger) {
  Tick(0);
  Do(supervisor_.OnWord({"report", sessions_["report"], true, false}, At(0.1)));
  Tick(30);
  EXPECT_THAT(killed_, IsEmpty());
  Tick(30.2);
  EXPECT_THAT(killed_, ElementsAre("report"));
}

TEST_F(SupervisorTest, LateWordsOfTheDeadDoNotMakeTheNextOneReady) {
  AllUp(0);
  const std::int64_t dead = sessions_["camera"];
  Crash("camera", 5);
  Tick(5);
  Do(supervisor_.OnWord({"camera", dead, false, true}, At(5.01)));  // sent before it was killed
  EXPECT_THAT(events_, IsEmpty());
  Say("camera", 5.5);
  EXPECT_EQ(events_.size(), 1u);
}

TEST_F(SupervisorTest, LateWordsOfTheDeadCountForNothingWhereTheClockWasSetBack) {
  AllUp(100);
  const std::int64_t dead = sessions_["camera"];
  Crash("camera", 5);
  Tick(5);
  Do(supervisor_.OnWord({"camera", dead, false, true}, At(5.01)));
  EXPECT_THAT(events_, IsEmpty());
  Say("camera", 5.5);
  EXPECT_EQ(events_.size(), 1u);
}

// A service that outlived its supervisor talks on; it is none of the one that was started now.
TEST_F(SupervisorTest, WordsOfAProcessItHasNotStartedKeepNobodyAlive) {
  Tick(0);
  for (double s = 0; s < 31; s += 1) {
    Do(supervisor_.OnWord({"report", At(-1000), false, true, At(s) - At(-1000)}, At(s)));
    EXPECT_THAT(events_, IsEmpty()) << "the report is not ready";
  }
  Tick(30.2);
  EXPECT_THAT(killed_, ElementsAre("report"));
}

// A service takes the time of day when it starts, the supervisor has that of its own start.
TEST_F(SupervisorTest, AServiceStartedAfterTheClockWasSetBackIsHeard) {
  AllUp(0);
  const std::int64_t dead = sessions_["camera"];
  Crash("camera", 5);
  Do(supervisor_.OnWord({"camera", At(-1), false, true, 7'000'000}, At(5)));  // nobody here has started it
  Tick(5);
  const std::int64_t session = At(5) - 3600 * kSecondUs;
  for (double s = 5.1; s < 40; s += 1) {
    const auto age_us = static_cast<std::int64_t>((s - 5) * 1e6) - 1000;
    Do(supervisor_.OnWord({"camera", session, false, true, age_us}, At(s)));
    EXPECT_EQ(events_.size(), s < 6 ? 1u : 0u) << "it is ready, once, at " << s;
    Say("report", s);
    Say("robot", s);
    Tick(s);
    EXPECT_THAT(killed_, IsEmpty());
  }
  for (double s = 40; s < 45; s += 1) {  // of these two no word keeps it alive
    Do(supervisor_.OnWord({"camera", dead, false, true, 4'000'000}, At(s)));
    Do(supervisor_.OnWord({"camera", At(-1), false, true, 7'000'000}, At(s)));
    Say("report", s);
    Say("robot", s);
  }
  Tick(45);
  EXPECT_THAT(killed_, ElementsAre("camera"));
}

TEST_F(SupervisorTest, WaitsLongerFromFailureToFailure) {
  AllUp(0);
  std::vector<int> waited_s;
  for (int i = 0; i < 8; ++i) {
    FailOnce("camera", 10 + 35 * i);
    waited_s.push_back(static_cast<int>(waited_s_ + 0.5));
  }
  EXPECT_THAT(waited_s, ElementsAre(0, 1, 2, 4, 8, 16, 30, 30));
}

TEST_F(SupervisorTest, FailuresLongAgoAreForgotten) {
  AllUp(0);
  for (int i = 0; i < 20; ++i) {
    FailOnce("camera", 10 + 301 * i);
    EXPECT_LT(waited_s_, 0.2);
  }
  EXPECT_EQ(supervisor_.phase("camera"), Phase::kRunning);
  EXPECT_EQ(supervisor_.restarts(), 20);
}

TEST_F(SupervisorTest, GivesUpWhatFailsTooOftenAndLeavesTheRestAlone) {
  AllUp(0);
  for (int i = 0; i < 8; ++i) {
    FailOnce("camera", 10 + i);
  }
  Crash("camera", 30);
  ASSERT_EQ(events_.size(), 2u);
  EXPECT_EQ(events_[1].kind, Kind::kGivenUp);
  EXPECT_THAT(events_[1].text, HasSubstr("ended 9 times within 300 s, 8 restarts are allowed"));
  Tick(1000);
  EXPECT_THAT(started_, IsEmpty());
  EXPECT_THAT(supervisor_.given_up(), ElementsAre("camera"));
  EXPECT_TRUE(supervisor_.refused().empty());
  Crash("robot", 1001);
  Tick(1001);
  EXPECT_THAT(started_, ElementsAre("robot")) << "the rest is still looked after";
}

TEST_F(SupervisorTest, RefusesAStationAServiceCannotWorkWith) {
  Tick(0);
  Do(supervisor_.OnEnd({"report", true, 1, "station.toml: report.part_timeout_s is 0"}, At(0.2)));
  EXPECT_EQ(supervisor_.refused(), "report ended with exit code 1: station.toml: report.part_timeout_s is 0");
  Tick(15);
  EXPECT_THAT(started_, IsEmpty()) << "the station ends";
}

TEST_F(SupervisorTest, AServiceKilledBeforeItWasReadyIsStartedAgain) {
  Tick(0);
  Crash("report", 0.2);
  Tick(0.2);
  EXPECT_THAT(started_, ElementsAre("report"));
  EXPECT_TRUE(supervisor_.refused().empty());
}

TEST_F(SupervisorTest, WhatItDoesNotKnowChangesNothing) {
  AllUp(0);
  Do(supervisor_.OnWord({"stranger", 1, false, true}, At(1)));
  EXPECT_THAT(events_, IsEmpty());
  Crash("stranger", 1);
  EXPECT_THAT(events_, IsEmpty());
  Tick(2);
  EXPECT_THAT(started_, IsEmpty());
}

TEST(SupervisionPolicy, IsReadWithLimits) {
  const auto load = [](const std::string& text) {
    return SupervisionPolicy::Load(*ConfigFile::Parse(text, "station.toml"));
  };
  const auto policy = load("[supervision]\nsilence_s = 20.0\nrestarts_max = 3\nkeep_running = false\n");
  ASSERT_TRUE(policy.ok()) << policy.error().message;
  EXPECT_EQ(policy->silence_s, 20.0);
  EXPECT_EQ(policy->restarts_max, 3);
  EXPECT_FALSE(policy->keep_running);
  EXPECT_EQ(load("")->silence_s, 5.0);
  EXPECT_EQ(load("")->StopPatienceS("fusion"), 10.0);
  EXPECT_EQ(load("")->StopPatienceS("recorder"), 40.0) << "10 s, and 1500 MB at 50 MB/s";
  EXPECT_EQ(load("")->StopPatienceS("recorder"), SupervisionPolicy().StopPatienceS("recorder"));
  EXPECT_EQ(
      load("[recorder]\nbacklog_mb = 500\n[supervision]\nstop_patience_s = 5.0\n")->StopPatienceS("recorder"),
      15.0);
  EXPECT_EQ(load("[supervision]\nrecorder_stop_patience_s = 7.0\n")->StopPatienceS("recorder"), 7.0);
  EXPECT_FALSE(load("[recorder]\nbacklog_mb = 1\n").ok());
  for (const char* wrong : {"silence_s = 1.0", "silence_s = nan", "restarts_max = -1", "silence = 5.0",
                            "backoff_s = 10.0\nbackoff_max_s = 5.0"}) {
    EXPECT_FALSE(load("[supervision]\n" + std::string(wrong)).ok()) << wrong;
  }
}

}  // namespace
}  // namespace forgescan
