// Services of a running line are killed without warning, as a user starts the line: every part still ends
// with one verdict, that is right or NOT_INSPECTED with a reason.
//
// In ctest a few kills; FORGESCAN_KILLS=50 [FORGESCAN_KILL_SEED=1] kill_line_test by hand for many, and
// FORGESCAN_KILL_EACH=1 for every service once. When to kill is told by the progress of the line, by lines of
// `forgescan inspect`, and not by a clock.
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <set>

#include "services/common/service/station.h"
#include "tests/line/prepared_station.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kPollMs = 20;
constexpr int kPartPatienceS = 90;

struct Kill {
  std::string service;
  int after_lines = 0;  // of progress, since the kill before
  std::string after;    // or when a line has this text; empty = by the count
};

int FromEnvironment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

class KillLine : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("forgescan_kill_" + std::to_string(getpid()));
    // Short waits, so that a part that cannot be whole any more is judged soon; they nest as the defaults do.
    WriteSmallStation(folder_, {{"packet_size_bytes = 9000", "$&\nview_timeout_s = 4.0"},
                                {"publish_every_nth_point = 1", "$&\nframe_timeout_s = 8.0"},
                                {"reference_temperature_degc = 900.0", "$&\nview_timeout_s = 12.0"},
                                {"start_translation_mm = 15.0", "cloud_timeout_s = 11.0\n$&"},
                                {"deviation_scale_mm = 0.3", "part_timeout_s = 75.0\n$&"},
                                {"\n\\[supervision\\]\n", "$&restarts_max = 100\nrestart_window_s = 5.0\n"}});
  }
  void TearDown() override {
    if (!HasFailure()) {
      fs::remove_all(folder_);
    }
  }
  // Of the one run there is; empty before it has begun.
  fs::path Station() const {
    std::error_code none_yet;
    for (const auto& run : fs::directory_iterator(folder_ / "runs", none_yet)) {
      return run.path() / "station";
    }
    return {};
  }

  // Runs the line and kills on the way. `kills` in their order.
  void Run(int parts, const std::vector<Kill>& kills) {
    Background inspect({"forgescan", "inspect", "--scale-divisor", "4", "--parts", std::to_string(parts),
                        "--takt", "30", "--patience", std::to_string(kPartPatienceS), "--station",
                        (folder_ / "station").string(), "--out", (folder_ / "runs").string()},
                       folder_ / "inspect.txt");
    std::size_t lines_at_kill = 0;
    auto next = kills.begin();
    while (inspect.running()) {
      poll(nullptr, 0, kPollMs);  // until there is more to read; nothing depends on how long it is
      const std::vector<std::string> lines = Progress(inspect.Text());
      const bool due =
          next != kills.end() && lines.size() > lines_at_kill && IsDue(*next, lines, lines_at_kill);
      if (due && Strike(inspect, next->service)) {
        std::printf("killed %-15s after: %s\n", next->service.c_str(), lines.back().c_str());
        lines_at_kill = lines.size();
        ++next;
      }
    }
    exit_code_ = inspect.Wait(0);
    text_ = inspect.Text();
  }
  // False if it does not run at the moment. No service: the whole line is told to stop.
  bool Strike(const Background& inspect, const std::string& service) {
    if (service.empty()) {
      inspect.Signal(SIGTERM);
      return true;
    }
    const pid_t pid = PidOfService(Station(), service);
    if (pid <= 0 || kill(pid, SIGKILL) != 0) {
      return false;
    }
    killed_.push_back(service);
    return true;
  }
  static bool IsDue(const Kill& kill, const std::vector<std::string>& lines, std::size_t since) {
    if (kill.after.empty()) {
      return lines.size() >= since + static_cast<std::size_t>(kill.after_lines);
    }
    return std::any_of(lines.begin() + static_cast<std::ptrdiff_t>(since), lines.end(),
                       [&](const std::string& line) { return line.find(kill.after) != std::string::npos; });
  }
  // Lines about parts.
  static std::vector<std::string> Progress(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
      if (line.find(" s  part ") != std::string::npos) {
        lines.push_back(line);
      }
    }
    return lines;
  }

  struct Verdict {
    std::string verdict, reason;
  };
  std::map<int, std::vector<Verdict>> Verdicts() const {
    std::map<int, std::vector<Verdict>> verdicts;
    static const std::regex said(" s  part (\\d+)  verdict (\\w+)(?:: (.*))?");
    for (const std::string& line : Progress(text_)) {
      if (std::smatch match; std::regex_search(line, match, said)) {
        verdicts[std::stoi(match[1])].push_back({match[2], match[3]});
      }
    }
    return verdicts;
  }
  std::string TrueVerdict(int part) const {
    char name[32];
    std::snprintf(name, sizeof name, "part_%06d.json", part);
    const Json truth = Json::parse(ReadAll(Station().parent_path() / "truth" / name), nullptr, false);
    return truth.is_discarded() ? "unknown" : truth["verdict"].get<std::string>();
  }
  // One verdict a part, none of them wrong. Returns how many parts were not inspected.
  int JudgeVerdicts(int parts) {
    int not_inspected = 0;
    const auto verdicts = Verdicts();
    for (int part = 1; part <= parts; ++part) {
      const auto found = verdicts.find(part);
      if (found == verdicts.end()) {
        ADD_FAILURE() << "part " << part << " is not accounted for\n" << text_;
        continue;
      }
      EXPECT_EQ(found->second.size(), 1u) << "part " << part << " has several verdicts\n" << text_;
      const Verdict& verdict = found->second.front();
      if (verdict.verdict == "NOT_INSPECTED") {
        ++not_inspected;
        EXPECT_NE(verdict.reason, "") << "part " << part;
      } else if (verdict.verdict != "NOT_DECIDABLE") {  // the sizes' uncertainty may leave it open
        EXPECT_EQ(verdict.verdict, TrueVerdict(part)) << "part " << part << " has a WRONG verdict\n" << text_;
      }
    }
    return not_inspected;
  }
  // Every killed service came back; how soon is printed.
  void JudgeRestarts() {
    const std::string log = ReadAll(Station() / "log/supervisor.log");
    static const std::regex ready(" (\\w+): is ready, ([0-9.]+) s after it ended");
    std::map<std::string, std::vector<double>> away_s;
    for (std::sregex_iterator match(log.begin(), log.end(), ready), end; match != end; ++match) {
      away_s[(*match)[1]].push_back(std::stod((*match)[2]));
    }
    for (const auto& [service, times_s] : away_s) {
      std::printf("%-15s ready again %zu times, at most %.2f s after it was killed\n", service.c_str(),
                  times_s.size(), *std::max_element(times_s.begin(), times_s.end()));
    }
    std::size_t restarts = 0;
    for (std::size_t at = log.find("is started again"); at != std::string::npos;
         at = log.find("is started again", at + 1)) {
      ++restarts;
    }
    EXPECT_EQ(restarts, killed_.size()) << log;
    EXPECT_NE(log.find("station: is down"), std::string::npos) << log;
    EXPECT_GE(exit_code_, 0) << "inspect itself was killed\n" << text_;
  }

  fs::path folder_;
  std::vector<std::string> killed_;
  std::string text_;
  int exit_code_ = -1;
};

// What the report service has written of the one part.
Json ReportOf(const fs::path& station) {
  for (const auto& entry : fs::directory_iterator(station / "results")) {
    if (fs::exists(entry.path() / "report.json")) {
      EXPECT_TRUE(fs::exists(entry.path() / "report.html"));
      return Json::parse(ReadAll(entry.path() / "report.json"));
    }
  }
  return Json();
}

TEST_F(KillLine, AStoppedLineStillJudgesThePartInWork) {
  Run(1, {{"", 0, "scan complete"}});
  EXPECT_EQ(exit_code_, 1);
  EXPECT_NE(text_.find("interrupted"), std::string::npos) << text_;
  const Json report = ReportOf(Station());
  ASSERT_FALSE(report.is_null()) << text_;
  EXPECT_EQ(report["verdict"], "OK") << report.dump(1);
  const std::string log = ReadAll(Station() / "log/supervisor.log");
  EXPECT_NE(log.find("station: is down, 0 restarts"), std::string::npos) << log;
  EXPECT_EQ(log.find("KILLED"), std::string::npos) << log;
  EXPECT_EQ(log.find("still in work"), std::string::npos) << log;
}

TEST_F(KillLine, AScanThatIsStoppedEndsByName) {
  Run(1, {{"", 0, "view 2 captured"}});
  const Json report = ReportOf(Station());
  ASSERT_FALSE(report.is_null()) << text_;
  EXPECT_EQ(report["verdict"], "NOT_INSPECTED");
  EXPECT_NE(report.dump().find("the robot service was stopped"), std::string::npos) << report.dump(1);
}

TEST_F(KillLine, RandomKillsLeaveNoPartWithoutVerdictAndNoneWithAWrongOne) {
  const int count = FromEnvironment("FORGESCAN_KILLS", 3);
  std::mt19937 random(static_cast<unsigned>(FromEnvironment("FORGESCAN_KILL_SEED", 7)));
  std::vector<Kill> kills;
  for (int i = 0; i < count; ++i) {
    const auto service = std::uniform_int_distribution<std::size_t>(0, kServiceNames.size() - 1)(random);
    kills.push_back({kServiceNames[service], std::uniform_int_distribution<int>(4, 18)(random), ""});
  }
  const int parts =
      1 + count * 16 / 25;  // 11 lines from kill to kill, 25 a part, fewer of one that is aborted
  Run(parts, kills);
  const int not_inspected = JudgeVerdicts(parts);
  JudgeRestarts();
  std::printf("%zu kills, %d parts, %d not inspected\n", killed_.size(), parts, not_inspected);
  EXPECT_GE(killed_.size(), static_cast<std::size_t>(count) / 2) << text_;
}

TEST_F(KillLine, EachServiceOnceDuringAScanAndTheNextPartIsRight) {
  if (FromEnvironment("FORGESCAN_KILL_EACH", 0) == 0) {
    GTEST_SKIP() << "takes ten minutes: FORGESCAN_KILL_EACH=1";
  }
  std::vector<Kill> kills;
  for (std::size_t i = 0; i < kServiceNames.size(); ++i) {  // in parts 1, 3, 5, ...
    kills.push_back({kServiceNames[i], 0, "part " + std::to_string(2 * i + 1) + "  view 3 captured"});
  }
  const int parts = 2 * static_cast<int>(kServiceNames.size());
  Run(parts, kills);
  JudgeVerdicts(parts);
  JudgeRestarts();
  EXPECT_EQ(killed_.size(), kServiceNames.size()) << text_;
  const auto verdicts = Verdicts();
  for (int part = 1; part <= parts; ++part) {
    const auto found = verdicts.find(part);
    if (found == verdicts.end()) {
      continue;  // told above
    }
    std::printf("part %2d %-15s %s %s\n", part,
                part % 2 == 1 ? kServiceNames[static_cast<std::size_t>(part / 2)] : "",
                found->second.front().verdict.c_str(), found->second.front().reason.c_str());
    if (part % 2 == 0) {
      EXPECT_NE(found->second.front().verdict, "NOT_INSPECTED") << "part " << part;
    }
  }
}

}  // namespace
}  // namespace forgescan::testing
