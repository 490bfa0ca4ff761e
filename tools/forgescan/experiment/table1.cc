// Fig. 13 and Table 1: one cold axle, inspected again and again.
#include <algorithm>
#include <cmath>

#include "tools/forgescan/experiment/bar_refinement.h"
#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/experiment/virtual_inspection.h"
#include "tools/virtual_station/scene.h"

namespace forgescan {
namespace {

// The paper's Table 1, total length, mm: for the same question about two states.
constexpr std::array kPaperLengthMm = {1888.46, 1888.35, 1888.46, 1888.37, 1888.37, 1888.46,
                                       1888.46, 1888.35, 1888.46, 1888.46, 1888.37};

struct Inspections {
  std::vector<MeasuredDimension> first;            // names and nominals
  std::vector<std::vector<double>> measured;       // by dimension and inspection
  std::vector<std::vector<double>> as_taught;      // the same with the robot's error of each visit left in
  std::vector<std::vector<double>> without_robot;  // and with that error known
};

// The part lies elsewhere at every inspection; it is cold, so it neither shrinks nor glows, and its size is
// the one the cell states.
std::vector<ViewState> ColdViews(const std::vector<ViewState>& views, double reference_degc) {
  std::vector<ViewState> cold = views;
  for (ViewState& view : cold) {
    view.part_degc = 20;
    view.scale = 1;
    view.pyrometer_degc = reference_degc;  // fusion has nothing to scale
  }
  return cold;
}

Result<double> ValueOf(const MeasuredDimension& dimension, int visit) {
  if (dimension.measured_mm) return *dimension.measured_mm;
  return Fail(ErrorCode::kUntrusted, "inspection {}: {}: {}", visit, dimension.name, dimension.reason);
}

Status Append(const InspectedPart& part, int visit, std::vector<std::vector<double>>& values) {
  values.resize(part.dimensions.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSIGN_OR_RETURN(const double value, ValueOf(part.dimensions[i], visit));
    values[i].push_back(value);
  }
  return {};
}

Result<std::vector<ViewState>> ViewsOf(const VirtualInspection& inspection, const PartState& part,
                                       int visit) {
  const CellConfig& config = inspection.config();
  std::vector<ViewState> views;
  for (int view = 0; view < static_cast<int>(config.views.size()); ++view) {
    ASSIGN_OR_RETURN(const ViewState state, inspection.cell().View(part, view, 0, visit));
    views.push_back(ScatterAtTarget(state, config));
  }
  return ColdViews(views, config.heat.reference_degc);
}

Result<Inspections> Inspect(const VirtualInspection& inspection, PartState part, int runs) {
  const CellConfig& config = inspection.config();
  ASSIGN_OR_RETURN(const std::vector<ViewState> empty, ViewsOf(inspection, part, kVisitWithoutPart));
  ASSIGN_OR_RETURN(const VisitCorrection correction, inspection.Correction(part, empty));
  Inspections all;
  for (int visit = 0; visit < runs; ++visit) {
    part.array_from_part = ArrayFromPart(config.part, config.seed, visit);
    ASSIGN_OR_RETURN(const std::vector<ViewState> views, ViewsOf(inspection, part, visit));
    std::vector<ViewCloud> clouds;
    for (const ViewState& view : views) {
      ASSIGN_OR_RETURN(ViewCloud cloud, inspection.Scan(part, view));
      clouds.push_back(std::move(cloud));
    }
    ASSIGN_OR_RETURN(const InspectedPart as_taught, inspection.Measure(clouds));
    RETURN_IF_ERROR(Append(as_taught, visit, all.as_taught));
    ASSIGN_OR_RETURN(const InspectedPart without,
                     inspection.Measure(clouds, WithoutRobot(inspection.matrices(), views, config)));
    RETURN_IF_ERROR(Append(without, visit, all.without_robot));
    for (ViewCloud& cloud : clouds) {
      ASSIGN_OR_RETURN(const CorrectedVisit corrected, correction.Of(cloud.view, cloud.cloud_in_camera));
      cloud.taught_from_actual = corrected.taught_from_actual;
    }
    ASSIGN_OR_RETURN(const InspectedPart measured, inspection.Measure(clouds));
    RETURN_IF_ERROR(Append(measured, visit, all.measured));
    all.first = measured.dimensions;
  }
  return all;
}

double Range(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low;
}

std::vector<double> Difference(std::vector<double> a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value / static_cast<double>(values.size());
  return sum;
}

double Deviation(const std::vector<double>& values) {
  const double mean = Mean(values);
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / std::max(1.0, static_cast<double>(values.size()) - 1));
}

// The widest gap between neighbours that leaves at least two values on either side, over the standard
// deviation: large when the values lie in two states.
double WidestGap(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double widest = 0;
  for (std::size_t i = 1; i + 2 < values.size(); ++i) {
    widest = std::max(widest, values[i + 1] - values[i]);
  }
  const double deviation = Deviation(values);
  return deviation > 0 ? widest / deviation : 0;
}

// Share of Gaussian samples of the same size whose widest gap is at least as wide.
double GapChance(double gap, std::size_t count, std::uint64_t seed) {
  constexpr int kSamples = 20'000;
  RandomStream random = DrawsOf(seed, Draw::kGapSample);
  int wider = 0;
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> values(count);
    for (double& value : values) value = random.Gaussian();
    wider += WidestGap(values) >= gap ? 1 : 0;
  }
  return static_cast<double>(wider) / kSamples;
}

double LimitOf(const std::string& name) { return name == "total_length" ? 0.05 : 0.015; }

Table ValueTable(const Inspections& all) {
  Table table{{"inspection"}, {}};
  for (const MeasuredDimension& dimension : all.first) table.header.push_back(dimension.name);
  for (std::size_t run = 0; run < all.measured.front().size(); ++run) {
    table.rows.push_back({fmt::format("{}", run + 1)});
    for (const auto& values : all.measured) table.rows.back().push_back(fmt::format("{:.3f}", values[run]));
  }
  return table;
}

Table SummaryTable(const Inspections& all, const AxleSize& size, ExperimentReport& report,
                   std::uint64_t seed) {
  Table table{
      {"dimension", "truth", "mean error", "range", "standard deviation", "range by the robot alone",
       "range without the robot", "range of the robot's share", "widest gap / sigma", "chance of such a gap"},
      {}};
  double least_chance = 1;
  for (std::size_t i = 0; i < all.measured.size(); ++i) {
    const std::vector<double>& values = all.measured[i];
    const std::string& name = all.first[i].name;
    double truth = std::nan("");
    for (const AxleDimension& dimension : kAxleDimensions) {
      if (name == dimension.name) truth = size.*dimension.size_mm;
    }
    const double gap = WidestGap(values), chance = GapChance(gap, values.size(), seed);
    least_chance = std::min(least_chance, chance);
    table.rows.push_back({name, fmt::format("{:.3f}", truth), fmt::format("{:+.4f}", Mean(values) - truth),
                          fmt::format("{:.4f}", Range(values)), fmt::format("{:.4f}", Deviation(values)),
                          fmt::format("{:.4f}", Range(all.as_taught[i])),
                          fmt::format("{:.4f}", Range(all.without_robot[i])),
                          fmt::format("{:.4f}", Range(Difference(all.as_taught[i], all.without_robot[i]))),
                          fmt::format("{:.2f}", gap), fmt::format("{:.3f}", chance)});
    report.goals.push_back({"range of " + name, Range(values), LimitOf(name), "mm"});
  }
  report.goals.push_back(
      {"no second state: least chance of a gap among the dimensions", least_chance, 0.01, "", true});
  const std::vector<double> paper(kPaperLengthMm.begin(), kPaperLengthMm.end());
  const double gap = WidestGap(paper);
  report.remarks.push_back(
      fmt::format("The paper's 11 total lengths have a range of {:.2f} mm and a widest gap of {:.2f} sigma, "
                  "of which 11 Gaussian values have a chance of {:.4f}: two states.",
                  Range(paper), gap, GapChance(gap, paper.size(), seed)));
  return table;
}

// Deviations from the mean, in bins.
Series Histogram(const std::vector<double>& values, double bin_mm, const std::string& label, int colour) {
  constexpr int kHalf = 8;
  Series series{label, Mark::kBars, {}, {}, colour};
  for (int bin = -kHalf; bin <= kHalf; ++bin) {
    series.x.push_back(1000 * bin * bin_mm);
    series.y.push_back(0);
  }
  const double mean = Mean(values);
  for (const double value : values) {
    const double bin = std::clamp(std::round((value - mean) / bin_mm), -1.0 * kHalf, 1.0 * kHalf);
    series.y[static_cast<std::size_t>(bin + kHalf)] += 1;
  }
  return series;
}

std::string RunPicture(const Inspections& all, const AxleSize& size) {
  std::string body;
  Chart runs{"Measured less true size", {"inspection"}, {"error, mm"}, {}, {}};
  for (std::size_t i = 0; i < all.measured.size(); ++i) {
    Series series{all.first[i].name, Mark::kLineDots, {}, {}, static_cast<int>(i)};
    double truth = 0;
    for (const AxleDimension& dimension : kAxleDimensions) {
      if (series.label == dimension.name) truth = size.*dimension.size_mm;
    }
    for (std::size_t run = 0; run < all.measured[i].size(); ++run) {
      series.x.push_back(static_cast<double>(run + 1));
      series.y.push_back(all.measured[i][run] - truth);
    }
    runs.series.push_back(std::move(series));
  }
  body += DrawChart(runs, {0, 0, 900, 360});
  for (std::size_t i = 0; i < all.measured.size(); ++i) {
    const std::string& name = all.first[i].name;
    const double limit = LimitOf(name);
    const Chart histogram{name,
                          {"from the mean, um"},
                          {"inspections", false, 0.0},
                          {Histogram(all.measured[i], limit / 10, "", static_cast<int>(i))},
                          {{-500 * limit, "", true}, {500 * limit, "", true}}};
    const double left = 300.0 * static_cast<double>(i % 3), top = 370 + 230.0 * static_cast<double>(i / 3);
    body += DrawChart(histogram, {left, top, 296, 225});
  }
  return SvgFile("fig13-table1", 900, 830, body);
}

Result<VirtualInspection> RefinedStation(const CellConfig& config, const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(const StationFiles files, Commission(config, options));
  ASSIGN_OR_RETURN(const BarRefinement bar, RefineWithBar(config, files, options.threads));
  return VirtualInspection::Create(config, WithCalibration(files, config, bar.refinement.calibration),
                                   options.threads);
}

}  // namespace

Result<ExperimentReport> RunTable1(const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(CellConfig config, LoadExperimentCell(options));
  config.part.odd_parts.clear();
  ASSIGN_OR_RETURN(const VirtualInspection inspection, RefinedStation(config, options));
  ASSIGN_OR_RETURN(const PartState part, inspection.cell().Part(0));
  ASSIGN_OR_RETURN(const Inspections all, Inspect(inspection, part, options.runs));
  ExperimentReport report;
  report.question = fmt::format(
      "One cold axle, laid down {} times within +-{} mm and +-{} degrees, inspected each time from the ten "
      "views as the services do it. The robot scatters at the point it looks at by {} mm and {:.1e} rad "
      "(standard deviation per axis), which gives ten visits an envelope of about 0.011 mm as the paper "
      "found at its balls. Truth: the size that was rendered. The last columns ask for two states, as the "
      "paper's total length has.",
      options.runs, config.part.position_scatter_mm, config.part.rotation_scatter_deg,
      config.robot.position_sd_mm, config.robot.rotation_sd_rad);
  report.tables.push_back(ValueTable(all));
  report.tables.push_back(SummaryTable(all, part.size, report, options.seed));
  report.remarks.emplace_back(
      "The station's calibration was refined by a ball bar at twenty places, and its views taught with it, "
      "as "
      "docs/calibration.md says.");
  report.remarks.emplace_back(
      "The range is that of the fusion service with standing surfaces: the cell's posts, which each view saw "
      "once without a part, tell the robot's error at this visit. By the robot alone: the same clouds, with "
      "that error left in.");
  report.remarks.emplace_back(
      "Without the robot: the same clouds fused with view matrices that know this visit's error of the "
      "robot, which no station does: the scanner's and the algorithms' own share.");
  report.remarks.emplace_back(
      "The mean error is that of calibration and view matrices, which stay the same between inspections; the "
      "dotted lines of the histograms are the goal for the range.");
  report.svg = RunPicture(all, part.size);
  return report;
}

}  // namespace forgescan
