// What if, against a full recomputation: the real programs, on a live bus, hear the recorded images and
// messages played with the changed station. Every verdict and size has to be what the replay with that change
// gives.
//
// In ctest the sample of logs/; by hand any session, and any change:
//   FORGESCAN_RECORDINGS="A.lcmlog B.lcmlog" FORGESCAN_CHANGE="fusion.reference_temperature_degc=880.0"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <sstream>

#include "services/common/bus/channels.h"
#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/stream_hub.h"
#include "tests/line/prepared_station.h"
#include "tools/forgescan/replay/replay_run.h"
#include "tools/forgescan/replay/scratch_folder.h"
#include "tools/forgescan/replay/what_if.h"

namespace forgescan::testing {
namespace {

using Verdicts = std::vector<fsmsg::verdict_t>;
using State = fsmsg::service_state_t;

constexpr const char* kBus = "udpm://239.255.76.67:7679?ttl=0&recv_buf_size=104857600";
constexpr std::int64_t kReadyUs = 60'000'000;
constexpr std::int64_t kVerdictUs = 120'000'000;  // from the end of playing to the last verdict
constexpr const char* kSpeed = "1";               // as recorded: the programs keep their own time

std::string FromEnvironment(const char* name, const std::string& otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : text;
}

std::vector<std::string> Recordings() {
  std::istringstream words(
      FromEnvironment("FORGESCAN_RECORDINGS", FORGESCAN_SOURCE_DIR "/logs/sample/axle.lcmlog"));
  return {std::istream_iterator<std::string>(words), {}};
}

class Recomputation : public ::testing::Test {
 protected:
  void SetUp() override {
    auto session = RecordedSession::Open(Recordings());
    ASSERT_TRUE(session.ok()) << session.error().message;
    session_.emplace(std::move(*session));
    auto folder = ScratchFolder::Make();
    ASSERT_TRUE(folder.ok());
    folder_.emplace(std::move(*folder));
    auto recorded = RecordedVerdicts(*session_);
    ASSERT_TRUE(recorded.ok()) << recorded.error().message;
    recorded_ = std::move(*recorded);
    ASSERT_FALSE(recorded_.empty());
  }

  // The recorded station with the change, in a new folder of this name.
  Result<Station> Unpack(const char* name, const std::vector<std::string>& values) {
    std::filesystem::create_directory(folder_->path() / name);
    return UnpackStation(*session_, {.config = {}, .values = values, .files = {}}, folder_->path() / name);
  }

  Verdicts Replayed(const std::string& change) {
    Verdicts verdicts;
    const auto station = Unpack("replay", {change});
    EXPECT_TRUE(station.ok()) << station.error().message;
    ReplayOptions options;
    options.services = *SelectServices({});
    options.chained = true;
    options.on_result = [&verdicts](const std::string& channel, ByteView message) {
      if (channel == kVerdict.name) {
        verdicts.push_back(*Decode<fsmsg::verdict_t>(message));
      }
    };
    const auto outcome = Replay(*session_, *station, options);
    EXPECT_TRUE(outcome.ok()) << outcome.error().message;
    return verdicts;
  }

  Verdicts Recomputed(const std::string& change) {
    const auto station = Unpack("live", {change, fmt::format("station.bus=\"{}\"", kBus)});
    EXPECT_TRUE(station.ok()) << station.error().message;
    auto bus = std::move(*LcmBus::Open(kBus));
    StreamHub hub(*bus, "recomputation_test");
    Verdicts verdicts;
    hub.Subscribe<fsmsg::verdict_t>(
        kVerdict, [&verdicts](const fsmsg::verdict_t& verdict) { verdicts.push_back(verdict); });
    std::set<std::string> ready;
    const SubscriptionId states = SubscribeState<State>(*bus, kServiceState, [&ready](const State& state) {
      if (state.state == State::STATE_READY) {
        ready.insert(state.name);
      }
    });
    const auto run_until = [&bus](std::int64_t patience_us, const auto& condition) {
      for (const std::int64_t end_us = bus->NowUs() + patience_us; !condition() && bus->NowUs() < end_us;) {
        EXPECT_TRUE(bus->RunOnce(100'000).ok());
      }
      return condition();
    };

    std::vector<std::unique_ptr<Background>> services;
    std::vector<std::string> play{"forgescan", "play", "--bus",     kBus,
                                  "--speed",   kSpeed, "--without", kServiceState.name};
    for (const ReplayableService& service : ReplayableServices()) {
      services.push_back(std::make_unique<Background>(
          std::vector<std::string>{std::string("forgescan-") + service.name, "--station",
                                   (folder_->path() / "live").string()},
          folder_->path() / (std::string(service.name) + ".txt")));
      for (const auto* channels : {&service.results, &service.durations}) {
        for (const char* channel : *channels) {
          play.insert(play.end(), {"--without", channel});
        }
      }
    }
    EXPECT_TRUE(run_until(kReadyUs, [&ready] { return ready.size() == ReplayableServices().size(); }))
        << ready.size() << " of the services are ready";
    const auto recordings = Recordings();
    play.insert(play.end(), recordings.begin(), recordings.end());
    Background player(play, folder_->path() / "play.txt");
    const auto played = [&player] { return !player.running(); };
    EXPECT_TRUE(run_until(session_->duration_us() + kVerdictUs, played)) << player.Text();
    EXPECT_EQ(player.Wait(0), 0) << player.Text();
    run_until(kVerdictUs, [&] { return verdicts.size() >= recorded_.size(); });
    bus->Unsubscribe(states);
    return verdicts;
  }

  std::optional<RecordedSession> session_;
  std::optional<ScratchFolder> folder_;
  Verdicts recorded_;
};

TEST_F(Recomputation, OfTheChangedStationGivesWhatTheReplaySays) {
  const std::string change = FromEnvironment("FORGESCAN_CHANGE", "fusion.reference_temperature_degc=850.0");
  const auto replayed = CompareVerdicts(recorded_, Replayed(change));
  const auto recomputed = CompareVerdicts(recorded_, Recomputed(change));
  ASSERT_EQ(recomputed.size(), replayed.size());
  int flips = 0;
  for (std::size_t i = 0; i < replayed.size(); ++i) {
    SCOPED_TRACE(fmt::format("part {}", replayed[i].part));
    EXPECT_EQ(recomputed[i].part, replayed[i].part);
    EXPECT_EQ(recomputed[i].utime, replayed[i].utime);
    EXPECT_EQ(recomputed[i].now_verdict, replayed[i].now_verdict);
    EXPECT_EQ(recomputed[i].now_reason, replayed[i].now_reason);
    flips += replayed[i].Flipped() ? 1 : 0;
    ASSERT_EQ(recomputed[i].dimensions.size(), replayed[i].dimensions.size());
    for (std::size_t j = 0; j < replayed[i].dimensions.size(); ++j) {
      const DimensionChange &live = recomputed[i].dimensions[j], &replay = replayed[i].dimensions[j];
      EXPECT_EQ(live.name, replay.name);
      EXPECT_THAT(live.now_mm, ::testing::NanSensitiveDoubleEq(replay.now_mm)) << live.name;
      EXPECT_THAT(live.now_u_mm, ::testing::NanSensitiveDoubleEq(replay.now_u_mm)) << live.name;
      EXPECT_EQ(live.now_verdict, replay.now_verdict) << live.name;
    }
  }
  EXPECT_GT(flips, 0) << "the change decides nothing, so this shows nothing";
  std::printf("%zu parts, with %s:\n%s", recorded_.size(), change.c_str(), WhatIfText(replayed).c_str());
}

}  // namespace
}  // namespace forgescan::testing
