// Fig. 15: the trend of the key dimensions over a pilot lot of hot parts while the die wears.
#include <algorithm>
#include <cmath>

#include "services/report/trend.h"
#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/virtual_inspection.h"

namespace forgescan {
namespace {

struct Lot {
  std::vector<std::string> names;
  std::vector<std::vector<TrendPoint>> measured, truth;  // by dimension
};

Status Append(const InspectedPart& inspected, const PartState& part, Lot& lot) {
  const std::size_t count = inspected.dimensions.size();
  lot.names.resize(count);
  lot.measured.resize(count);
  lot.truth.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const MeasuredDimension& dimension = inspected.dimensions[i];
    lot.names[i] = dimension.name;
    if (dimension.measured_mm) {
      lot.measured[i].push_back({static_cast<double>(part.part), *dimension.measured_mm});
    }
    for (const AxleDimension& known : kAxleDimensions) {
      if (dimension.name == known.name) {
        lot.truth[i].push_back({static_cast<double>(part.part), part.size.*known.size_mm});
      }
    }
  }
  return {};
}

Result<Lot> InspectLot(const VirtualInspection& inspection, int parts) {
  Lot lot;
  for (int number = 0; number < parts; ++number) {
    ASSIGN_OR_RETURN(const PartState part, inspection.cell().Part(number));
    std::vector<ViewCloud> clouds;
    for (int view = 0; view < static_cast<int>(inspection.config().views.size()); ++view) {
      ASSIGN_OR_RETURN(const ViewState state, inspection.cell().View(part, view));
      ASSIGN_OR_RETURN(ViewCloud cloud, inspection.Scan(part, state));
      clouds.push_back(std::move(cloud));
    }
    ASSIGN_OR_RETURN(const InspectedPart inspected, inspection.Measure(clouds));
    RETURN_IF_ERROR(Append(inspected, part, lot));
  }
  return lot;
}

double WearOf(const PartConfig& config, const std::string& name) {
  if (name.find("plate") != std::string::npos) return config.plate_wear_mm_per_part;
  return name.find("cylinder") != std::string::npos ? config.cylinder_wear_mm_per_part : 0;
}

// Half width of the 95 % interval of the slope.
double SlopeHalfWidth(const Trend& trend) {
  return trend.t_limit * trend.residual_sigma_mm / std::sqrt(trend.sxx);
}

// Largest difference of measured and true size, each from its mean over the lot.
double WorstWithin(const std::vector<TrendPoint>& measured, const std::vector<TrendPoint>& truth) {
  if (measured.size() != truth.size()) return std::nan("");
  double mean = 0, worst = 0;
  const auto count = static_cast<double>(truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) mean += (measured[i].value_mm - truth[i].value_mm) / count;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    worst = std::max(worst, std::abs(measured[i].value_mm - truth[i].value_mm - mean));
  }
  return worst;
}

Result<Table> SlopeTable(const Lot& lot, const PartConfig& config, ExperimentReport& report) {
  Table table{{"dimension", "wear of the die, mm/part", "slope of the true sizes", "slope measured",
               "95 % interval", "found", "worst error within the lot mm"},
              {}};
  for (std::size_t i = 0; i < lot.names.size(); ++i) {
    ASSIGN_OR_RETURN(const Trend measured, FitTrend(lot.measured[i]));
    ASSIGN_OR_RETURN(const Trend truth, FitTrend(lot.truth[i]));
    table.rows.push_back({lot.names[i], fmt::format("{:+.3f}", WearOf(config, lot.names[i])),
                          fmt::format("{:+.4f}", truth.slope_mm), fmt::format("{:+.4f}", measured.slope_mm),
                          fmt::format("+-{:.4f}", SlopeHalfWidth(measured)),
                          measured.significant ? "yes" : "no",
                          fmt::format("{:.4f}", WorstWithin(lot.measured[i], lot.truth[i]))});
    if (lot.names[i] != "total_length") {
      report.goals.push_back({"slope of " + lot.names[i] + " against that of the true sizes",
                              std::abs(measured.slope_mm - truth.slope_mm), 0.005, "mm/part"});
    }
  }
  return table;
}

std::string TrendPicture(const Lot& lot) {
  std::string body;
  for (std::size_t i = 0; i < lot.names.size(); ++i) {
    Chart chart{lot.names[i], {"part"}, {"size, mm"}, {}, {}};
    Series truth{"true", Mark::kDashed, {}, {}, 2}, measured{"measured", Mark::kLineDots, {}, {}, 0};
    for (const TrendPoint& point : lot.truth[i]) {
      truth.x.push_back(point.part_index + 1);
      truth.y.push_back(point.value_mm);
    }
    for (const TrendPoint& point : lot.measured[i]) {
      measured.x.push_back(point.part_index + 1);
      measured.y.push_back(point.value_mm);
    }
    chart.series = {truth, measured};
    const double left = 450.0 * static_cast<double>(i % 2), top = 270.0 * static_cast<double>(i / 2);
    body += DrawChart(chart, {left, top, 445, 265});
  }
  return SvgFile("fig15", 900, 270 * static_cast<double>((lot.names.size() + 1) / 2), body);
}

}  // namespace

Result<ExperimentReport> RunFig15(const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(CellConfig config, LoadExperimentCell(options));
  config.part.odd_parts.clear();
  ASSIGN_OR_RETURN(const VirtualInspection inspection, VirtualInspection::Create(config, options));
  ASSIGN_OR_RETURN(const Lot lot, InspectLot(inspection, options.runs));
  ExperimentReport report;
  report.question = fmt::format(
      "{} hot axles one after the other from about {} degC, inspected from ten views while they cool, with "
      "sizes that scatter from part to part by {} (length), {} (plates) and {} mm (cylinders) about a die "
      "that wears. Truth: the sizes that were rendered, at {} degC. The trend is the report's own.",
      options.runs, config.heat.start_degc, config.part.length_sd_mm, config.part.plate_sd_mm,
      config.part.cylinder_sd_mm, config.heat.reference_degc);
  ASSIGN_OR_RETURN(Table table, SlopeTable(lot, config.part, report));
  report.tables.push_back(std::move(table));
  report.remarks.emplace_back(
      "Whether a trend of nine parts is found depends on the scatter of the parts themselves; the goal is on "
      "what the inspection adds: the slope of the measured sizes against the slope of the true ones.");
  report.svg = TrendPicture(lot);
  return report;
}

}  // namespace forgescan
