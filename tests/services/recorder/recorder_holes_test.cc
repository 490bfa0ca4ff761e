// No silent hole: on a bus that loses, doubles and reorders, with recorders that are stopped and started at
// any time, whatever was said is in a recording, or a recording says that it lacks it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_header.h"
#include "services/recorder/recorder_service.h"
#include "tests/services/recorder/line_script.h"
#include "tests/services/recorder/recordings.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr int kTrials = 200, kParts = 3;
using Key = std::tuple<std::string, std::int64_t, std::int64_t>;  // channel, session, sequence

Key KeyOf(const Said& said) { return {said.channel, said.session, said.sequence}; }

// A recorder on a node of its own, from its start to its stop.
class Life {
 public:
  Life(SimNetwork& network, const RecorderConfig& config, const RecordedStation& station)
      : network_(network), bus_(network.AddNode()) {
    hub_ = std::make_unique<StreamHub>(bus_, "recorder");
    monitor_ = std::make_unique<ServiceMonitor>(*hub_, "recorder", "");
    auto service = RecorderService::Create(*hub_, *monitor_, config, station);
    EXPECT_TRUE(service.ok());
    service_ = *std::move(service);
    service_->Drain();
  }
  ~Life() {
    service_.reset();
    monitor_.reset();
    hub_.reset();
    network_.RemoveNode(bus_);
  }
  Life(const Life&) = delete;
  Life& operator=(const Life&) = delete;

 private:
  SimNetwork& network_;
  SimBus& bus_;
  std::unique_ptr<StreamHub> hub_;
  std::unique_ptr<ServiceMonitor> monitor_;
  std::unique_ptr<RecorderService> service_;
};

// What the recordings hold, and what they say they lack.
struct Evidence {
  std::set<Key> held;
  std::vector<fsmsg::recording_gap_t> gaps;  // numbered
  std::vector<Recording> recordings;

  explicit Evidence(std::vector<Recording> all) : recordings(std::move(all)) {
    for (const Recording& recording : recordings) {
      for (const LogEvent& event : recording.events) {
        if (const auto header = CheckStreamHeader(event.message); header.ok()) {
          held.insert({event.channel, header->session, header->sequence});
        }
      }
      for (std::size_t i = 0; recording.closed.has_value() && i < recording.closed->gaps.size(); ++i) {
        gaps.push_back(recording.closed->gaps[i]);
      }
    }
  }
  bool Admits(const Said& said) const {
    return std::any_of(gaps.begin(), gaps.end(), [&](const fsmsg::recording_gap_t& gap) {
      return gap.channel == said.channel && gap.session == said.session &&
             gap.first_sequence <= said.sequence && said.sequence <= gap.last_sequence;
    });
  }
  // A recording of the part that says it is not whole.
  bool PartIsIncomplete(int part) const {
    return std::any_of(recordings.begin(), recordings.end(), [part](const Recording& recording) {
      return recording.name.part == part &&
             (!recording.closed.has_value() || !recording.closed->gaps.empty());
    });
  }
};

struct Outcome {
  int said = 0;
  int held = 0;
  int admitted = 0;
  int unheard = 0;
  int complete_parts = 0;
};

class Trial {
 public:
  Trial(int seed, const fs::path& folder) : random_(static_cast<std::uint64_t>(seed)), folder_(folder) {
    config_.folder = (folder / "recordings").string();
    config_.min_free_mb = 1;
    config_.part_timeout_s = 60;
    fs::create_directories(folder / "recordings");  // even if no recorder ever runs
    std::ofstream(folder / "station.toml") << "# a station\n";
    station_ = {"test", "1", "", "", {{"station.toml", (folder / "station.toml").string()}}};
  }

  Outcome Run() {
    StartLine();
    for (int part = 1; part <= kParts; ++part) {
      line_->Part(part, 2, [this] { Pause(); });
      network_.RunFor(Below(3 * kSecondUs));
    }
    network_.SetFaults({});
    network_.RunFor(Below(2) == 0 ? 90 * kSecondUs : Below(2 * kSecondUs));  // or stopped before it is quiet
    life_.reset();
    return Judge();
  }

 private:
  std::int64_t Below(std::int64_t limit) {
    return std::uniform_int_distribution<std::int64_t>(0, limit - 1)(random_);
  }
  double Share(double limit) { return std::uniform_real_distribution<double>(0.0, limit)(random_); }

  // A third of the senders forgets so soon that much is lost for good; a third of the recorders is stopped.
  void StartLine() {
    network_.SetFaults(
        {.loss = Share(0.4), .large_loss = Share(0.9), .duplicate = Share(0.3), .jitter_us = Below(60'000)});
    const bool recorder_first = Below(4) != 0;
    if (recorder_first) {
      life_ = std::make_unique<Life>(network_, config_, station_);
      network_.RunFor(kSecondUs);
    }
    StreamOptions options;
    if (Below(3) == 0) {
      options.history_bytes = options.burst_bytes = 1 + Below(300'000);
      options.give_up_us = 1'000'000;
    }
    hub_ = std::make_unique<StreamHub>(network_.AddNode(), "line", options);
    line_ = std::make_unique<LineScript>(*hub_, 80'000);
    network_.RunFor(kSecondUs);
    stops_ = Below(3) == 0 || !recorder_first;
    alive_.push_back(life_ != nullptr);
  }

  void Pause() {
    network_.RunFor(Below(20'000));
    if (stops_ && Below(60) == 0) {
      if (life_ == nullptr) {
        life_ = std::make_unique<Life>(network_, config_, station_);
      } else {
        life_.reset();
      }
    }
    alive_.push_back(life_ != nullptr);
  }

  Outcome Judge() const {
    Outcome outcome;
    const Evidence evidence(ReadRecordings(config_.folder));
    std::map<int, bool> whole;  // by part: all that was said of it is held
    for (std::size_t i = 0; i < line_->said().size(); ++i) {
      const Said& said = line_->said()[i];
      const bool held = evidence.held.contains(KeyOf(said)), admitted = evidence.Admits(said);
      whole.try_emplace(said.part, true).first->second &= held;
      ++outcome.said;
      outcome.held += held ? 1 : 0;
      outcome.admitted += !held && admitted ? 1 : 0;
      const bool heard = alive_[i] && alive_[i + 1];  // a recorder ran when it was said
      outcome.unheard += heard ? 0 : 1;
      EXPECT_TRUE(held || admitted || !heard || evidence.PartIsIncomplete(said.part))
          << said.channel << " " << said.sequence << " of part " << said.part;
    }
    for (const Recording& recording : evidence.recordings) {
      if (recording.name.part.has_value() && recording.name.complete) {
        ++outcome.complete_parts;
        EXPECT_TRUE(whole.at(*recording.name.part)) << recording.path << " claims to be whole";
      }
    }
    return outcome;
  }

  std::mt19937_64 random_;
  fs::path folder_;
  RecorderConfig config_;
  RecordedStation station_;
  SimNetwork network_{random_()};
  std::unique_ptr<StreamHub> hub_;
  std::unique_ptr<LineScript> line_;
  std::unique_ptr<Life> life_;
  bool stops_ = false;
  std::vector<bool> alive_;  // whether a recorder ran before the first and after each word of the line
};

TEST(RecorderHoles, NoneIsSilentInSeededTrials) {
  const fs::path base = fs::path(::testing::TempDir()) / ("forgescan_holes_" + std::to_string(getpid()));
  Outcome sum;
  for (int seed = 1; seed <= kTrials; ++seed) {
    SCOPED_TRACE(seed);
    fs::create_directories(base);
    const Outcome outcome = Trial(seed, base).Run();
    sum.said += outcome.said;
    sum.held += outcome.held;
    sum.admitted += outcome.admitted;
    sum.unheard += outcome.unheard;
    sum.complete_parts += outcome.complete_parts;
    fs::remove_all(base);
  }
  EXPECT_GT(sum.held, sum.said / 2);
  EXPECT_GT(sum.admitted, 100) << "or the trials lose nothing";
  EXPECT_GT(sum.complete_parts, kTrials / 2) << "or the trials are never whole";
  EXPECT_LT(sum.complete_parts, kTrials * kParts) << "or they always are";
  RecordProperty("said", sum.said);
  RecordProperty("held", sum.held);
  RecordProperty("admitted", sum.admitted);
  RecordProperty("unheard", sum.unheard);
  RecordProperty("complete_parts", sum.complete_parts);
}

}  // namespace
}  // namespace forgescan::testing
