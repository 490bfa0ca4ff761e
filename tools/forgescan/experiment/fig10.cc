// Fig. 10: our registration against the trimmed ICP, with clamp and platform about the part.
#include <algorithm>
#include <array>

#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/registration_runs.h"

namespace forgescan {
namespace {

constexpr double kRightMm = 0.1;        // what a part with 0.5 mm tolerances needs
constexpr double kGuessedShare = 0.95;  // of the part's points, by one who does not know the clutter
constexpr std::size_t kPoints = 40'000;

struct Case {
  Workpiece workpiece;
  double foreign_share;
};

Result<std::vector<Case>> MakeCases(const ExperimentOptions& options) {
  std::vector<Case> cases;
  ASSIGN_OR_RETURN(Workpiece axle, MakeAxleInClamp(options.cell));
  cases.push_back({std::move(axle), 0.22});
  ASSIGN_OR_RETURN(Workpiece cover, MakeCoverOnPlatform());
  cases.push_back({std::move(cover), 0.4});
  return cases;
}

std::vector<std::string> Row(const Case& one, const std::string& method, const Tally& tally) {
  return {fmt::format("{}, {:.0f} % foreign", one.workpiece.name, 100 * one.foreign_share),
          method,
          fmt::format("{} of {}", tally.right, tally.runs),
          fmt::format("{}", tally.near),
          fmt::format("{}", tally.wrong),
          fmt::format("{}", tally.refused),
          fmt::format("{:.3f}", tally.median_mm),
          fmt::format("{:.3f}", tally.worst_mm)};
}

// Share of all starts whose error is below x; a refusal is never below.
Series Distribution(const std::string& label, std::vector<double> corner_mm, Mark mark, int colour) {
  Series series{label, mark, {}, {}, colour};
  const auto runs = static_cast<double>(corner_mm.size());
  std::erase(corner_mm, kRefused);
  std::sort(corner_mm.begin(), corner_mm.end());
  for (std::size_t i = 0; i < corner_mm.size(); ++i) {
    series.x.push_back(corner_mm[i]);
    series.y.push_back(100 * static_cast<double>(i + 1) / runs);
  }
  return series;
}

}  // namespace

Result<ExperimentReport> RunFig10(const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(const std::vector<Case> cases, MakeCases(options));
  ExperimentReport report;
  report.question = fmt::format(
      "Two parts with what the paper's Fig. 10 has about them, {} points of 0.03 mm noise, {} random starts "
      "each, off by 10 mm and 3 degrees. The trimmed ICP (nearest point of the surface, nearest share of the "
      "pairs, rigid motion) is told the true share of the part's points, or guesses {:.0f} %. Truth: the "
      "pose the scan was moved by. Error: of the worst corner of the part's box; right is below {} mm.",
      kPoints, options.runs, 100 * kGuessedShare, kRightMm);
  Table table{{"part", "method", "right", "below 1 mm", "wrong", "refused", "median error mm", "worst mm"},
              {}};
  Chart chart{"Starts that end below an error",
              {"error of the worst corner, mm", true, 1e-4, 100.0},
              {"starts, %", false, 0.0, 105.0},
              {},
              {{kRightMm, "right", true}}};
  for (const Case& one : cases) {
    ScanRequest request;
    request.points = kPoints;
    request.foreign_share = one.foreign_share;
    const Mark mark = &one == &cases.front() ? Mark::kLine : Mark::kDashed;
    const auto add = [&](const std::string& method, const std::vector<double>& corner_mm, int colour) {
      table.rows.push_back(Row(one, method, Count(corner_mm, kRightMm)));
      chart.series.push_back(Distribution(method + ", " + one.workpiece.name, corner_mm, mark, colour));
    };
    const auto ours = RunOurs(one.workpiece, request, options);
    add("ours", ours, 2);
    add("trimmed, told", RunTrimmed(one.workpiece, request, 1 - one.foreign_share, options), 3);
    add("trimmed, guessed", RunTrimmed(one.workpiece, request, kGuessedShare, options), 1);
    const Tally tally = Count(ours, kRightMm);
    report.goals.push_back({one.workpiece.name + ": starts of ours that end right", 1.0 * tally.right,
                            1.0 * tally.runs, "", true});
  }
  report.tables.push_back(std::move(table));
  report.svg = SvgFile("fig10", 900, 440, DrawChart(chart, {0, 0, 900, 440}));
  return report;
}

}  // namespace forgescan
