// Registration over the share of foreign points.
#include <array>

#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/registration_runs.h"

namespace forgescan {
namespace {

constexpr std::array kShares = {0.0, 0.1, 0.22, 0.35, 0.42, 0.5};
constexpr double kRightMm = 0.02;  // worst corner of the 1.9 m part

class Curves {
 public:
  void Add(double share, const Tally& tally) {
    const auto add = [&](Series& series, double value) {
      series.x.push_back(100 * share);
      series.y.push_back(value);
    };
    add(right_, 100.0 * tally.right / tally.runs);
    add(refused_, 100.0 * tally.refused / tally.runs);
    add(wrong_, 100.0 * tally.wrong / tally.runs);
    add(median_, tally.median_mm);
    add(worst_, tally.worst_mm);
  }

  std::string Svg() const {
    const Chart starts{"How the starts ended",
                       {"foreign points, % of the scan"},
                       {"starts, %", false, 0.0, 105.0},
                       {right_, refused_, wrong_}};
    const Chart errors{"Error of the worst corner",
                       {"foreign points, % of the scan"},
                       {"error, mm", true, 5e-4, 0.05},
                       {median_, worst_},
                       {{0.01, "goal to 22 %"}, {0.02, "goal at 35 %"}}};
    return SvgFile("clutter", 900, 400,
                   DrawChart(starts, {0, 0, 450, 400}) + DrawChart(errors, {450, 0, 450, 400}));
  }

 private:
  Series right_{"right", Mark::kLineDots, {}, {}, 2}, refused_{"refused", Mark::kLineDots, {}, {}, 3};
  Series wrong_{"wrong by 1 mm", Mark::kDashed, {}, {}, 1};
  Series median_{"median", Mark::kLineDots, {}, {}, 0}, worst_{"worst", Mark::kLineDots, {}, {}, 1};
};

std::vector<std::string> Row(double share, const Tally& tally) {
  return {fmt::format("{:.0f} %", 100 * share), fmt::format("{} of {}", tally.right, tally.runs),
          fmt::format("{}", tally.near),        fmt::format("{}", tally.wrong),
          fmt::format("{}", tally.refused),     fmt::format("{:.4f}", tally.median_mm),
          fmt::format("{:.4f}", tally.worst_mm)};
}

void AddGoals(double share, const Tally& tally, std::vector<Goal>& goals) {
  if (share == 0.22) {
    goals.push_back({"worst corner at 22 % foreign points", tally.worst_mm, 0.01, "mm"});
    goals.push_back({"starts that end right at 22 %", 1.0 * tally.right, 1.0 * tally.runs, "", true});
  } else if (share == 0.35) {
    goals.push_back({"worst corner at 35 % foreign points", tally.worst_mm, 0.02, "mm"});
    goals.push_back({"starts that end right at 35 %", 1.0 * tally.right, 1.0 * tally.runs, "", true});
  }
}

}  // namespace

Result<ExperimentReport> RunClutter(const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(const Workpiece axle, MakeAxleInClamp(options.cell));
  ExperimentReport report;
  report.question = fmt::format(
      "The axle among points of conveyor, rests and clamp, {} points of 0.03 mm noise, {} random starts at "
      "each share, off by 10 mm and 3 degrees. Truth: the pose the scan was moved by. Error: of the worst "
      "corner of the part's box; right is below {} mm.",
      ScanRequest().points, options.runs, kRightMm);
  Table table{{"foreign points", "right", "below 1 mm", "wrong", "refused", "median error mm", "worst mm"},
              {}};
  Curves curves;
  for (const double share : kShares) {
    ScanRequest request;
    request.foreign_share = share;
    const Tally tally = Count(RunOurs(axle, request, options), kRightMm);
    table.rows.push_back(Row(share, tally));
    AddGoals(share, tally, report.goals);
    curves.Add(share, tally);
  }
  report.tables.push_back(std::move(table));
  report.svg = curves.Svg();
  return report;
}

}  // namespace forgescan
