// What if, against a full recomputation: the real programs, on a live bus, hear the recorded images and
// messages played with the changed station. Every verdict and size has to be what the replay with that change
// gives.
//
// In ctest the sample of logs/; by hand any session, and any change:
//   FORGESCAN_RECORDINGS="A.lcmlog B.lcmlog" FORGESCAN_CHANGE="registration.start_rotation_rad=0.01"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <regex>
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
using SaidState = fsmsg::service_state_t;

constexpr const char* kBus = "udpm://239.255.76.67:7679?ttl=0&recv_buf_size=104857600";
// A scanner whose cameras and projector stand farther apart than it was told puts every surface too deep.
constexpr double kPlainScale = 1.0003;
constexpr std::int64_t kReadyUs = 60'000'000;
constexpr std::int64_t kVerdictUs = 240'000'000;  // from the end of playing to the last verdict
constexpr const char* kSpeed = "1";               // as recorded: the programs keep their own time

std::string FromEnvironment(const char* name, const std::string& otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : text;
}

// The same calibration with longer translations, T between the cameras and Tp to the projector.
std::string Rescaled(const std::string& calibration) {
  static const std::regex translation(R"((\nTp?: [^\[]*\[)([^\]]*)\])");
  std::string text;
  auto rest = calibration.begin();
  for (std::sregex_iterator match(calibration.begin(), calibration.end(), translation), end; match != end;
       ++match) {
    text.append(rest, (*match)[1].second);
    std::istringstream numbers((*match)[2].str());
    const char* separator = " ";
    for (std::string number; std::getline(numbers, number, ','); separator = ", ") {
      text += fmt::format("{}{}", separator, kPlainScale * std::stod(number));
    }
    rest = (*match)[2].second;
  }
  return text.append(rest, calibration.end());
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

  // FORGESCAN_CHANGE, or else another calibration.
  StationChanges Change() const {
    if (const std::string value = FromEnvironment("FORGESCAN_CHANGE", ""); !value.empty()) {
      return {.config = {}, .values = {value}, .files = {}};
    }
    const std::filesystem::path path = folder_->path() / "stereo.yaml";
    for (const fsmsg::recorded_file_t& file : session_->files()) {
      if (file.name.starts_with("calibration")) {
        std::ofstream(path) << Rescaled({file.data.begin(), file.data.end()});
      }
    }
    return {.config = {}, .values = {}, .files = {{"calibration", path.string()}}};
  }

  // The recorded station with the change, in a new folder of this name.
  Result<Station> Unpack(const char* name, const StationChanges& changes) {
    std::filesystem::create_directory(folder_->path() / name);
    return UnpackStation(*session_, changes, folder_->path() / name);
  }

  // The replay keeps a station's files in one folder; programs look for them where station.toml says.
  static void PutFilesWhereTheyBelong(const Station& unpacked) {
    const auto station = Station::Load(unpacked.folder);
    for (const auto file :
         {&Station::calibration, &Station::pattern, &Station::views, &Station::model, &Station::features}) {
      const std::filesystem::path place = (*station).*file;
      std::filesystem::create_directories(place.parent_path());
      if (place != std::filesystem::path(unpacked.*file)) {
        std::filesystem::copy_file(unpacked.*file, place);
      }
    }
  }

  Verdicts Replayed(const StationChanges& changes) {
    Verdicts verdicts;
    const auto station = Unpack("replay", changes);
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

  Verdicts Recomputed(StationChanges changes) {
    changes.values.push_back(fmt::format("station.bus=\"{}\"", kBus));
    const auto station = Unpack("live", changes);
    EXPECT_TRUE(station.ok()) << station.error().message;
    PutFilesWhereTheyBelong(*station);
    auto bus = std::move(*LcmBus::Open(kBus));
    StreamHub hub(*bus, "recomputation_test");
    Verdicts verdicts;
    hub.Subscribe<fsmsg::verdict_t>(
        kVerdict, [&verdicts](const fsmsg::verdict_t& verdict) { verdicts.push_back(verdict); });
    std::set<std::string> ready;
    const auto states = SubscribeState<SaidState>(*bus, kServiceState, [&ready](const SaidState& state) {
      if (state.state == SaidState::STATE_READY) {
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
    if (!run_until(kReadyUs, [&ready] { return ready.size() == ReplayableServices().size(); })) {
      ADD_FAILURE() << ready.size() << " of the services are ready";
      return verdicts;
    }
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
  const StationChanges change = Change();
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
  std::printf("%zu parts:\n%s", recorded_.size(), WhatIfText(replayed).c_str());
}

}  // namespace
}  // namespace forgescan::testing
