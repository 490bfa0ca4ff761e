#include "services/report/report_writer.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "services/report/deviation_picture.h"
#include "services/report/report_files.h"
#include "services/report/report_html.h"
#include "services/report/report_json.h"
#include "services/report/report_text.h"

namespace forgescan {
namespace {

ReportedTrend TrendOf(const std::string& name, std::vector<HistoryPoint> points) {
  ReportedTrend reported{name, std::move(points), {}, {}};
  std::vector<TrendPoint> values;
  for (const HistoryPoint& point : reported.points) {
    if (std::isfinite(point.measured_mm)) {
      values.push_back({static_cast<double>(point.part_index), point.measured_mm});
    }
  }
  const Result<Trend> trend = FitTrend(values);
  if (trend.ok()) {  // too few values is no fault: the page says so
    const HistoryPoint& newest = reported.points.back();
    const double guard_mm = std::isfinite(newest.uncertainty_mm) ? newest.uncertainty_mm : 0.0;
    reported.trend = *trend;
    reported.parts_to_limit = PartsToLimit(*trend, {newest.lower_mm, newest.upper_mm, guard_mm},
                                           static_cast<double>(newest.part_index));
  }
  return reported;
}

std::string PathOf(const std::string& results, const std::string& folder, const char* file) {
  return (std::filesystem::path(results) / folder / file).string();
}

}  // namespace

std::string ReportFolderName(int part, std::int64_t utime) {
  return fmt::format("{}-part-{:06}", UtcFileText(utime), part);
}

Result<ReportWriter> ReportWriter::Open(const std::string& results_folder, const ReportConfig& config) {
  std::error_code failure;
  std::filesystem::create_directories(results_folder, failure);
  if (failure) {
    return Fail(ErrorCode::kIo, "cannot make the results folder {}: {}", results_folder, failure.message());
  }
  const std::string path = (std::filesystem::path(results_folder) / "history.sqlite").string();
  ASSIGN_OR_RETURN(History history, History::Open(path));
  return ReportWriter(results_folder, std::move(history), config);
}

ReportWriter::ReportWriter(std::string results_folder, History history, const ReportConfig& config)
    : results_folder_(std::move(results_folder)), history_(std::move(history)), config_(config) {}

Status ReportWriter::Remember(const PartReport& report, std::int64_t utime) {
  return history_.Append({report.part, utime, report.verdict.verdict, report.verdict.reason,
                          ReportFolderName(report.part, utime), report.dimensions});
}

Result<std::vector<ReportedTrend>> ReportWriter::Trends(const PartReport& report) const {
  std::vector<ReportedTrend> trends;
  for (const JudgedDimension& dimension : report.dimensions) {
    ASSIGN_OR_RETURN(std::vector<HistoryPoint> points,
                     history_.LastValues(dimension.name, config_.trend_parts));
    trends.push_back(TrendOf(dimension.name, std::move(points)));
  }
  return trends;
}

Status ReportWriter::WriteJson(const PartReport& report, const std::string& folder_name) const {
  return WriteWholeFile(PathOf(results_folder_, folder_name, "report.json"), ReportJson(report));
}

Status ReportWriter::WritePage(const PartReport& report, const std::string& folder_name) const {
  return WriteWholeFile(PathOf(results_folder_, folder_name, "report.html"), ReportHtml(report));
}

Status ReportWriter::WriteIndex(const std::string& station) const {
  ASSIGN_OR_RETURN(const std::vector<PartRecord> parts, history_.LastParts(config_.index_parts));
  return WriteWholeFile((std::filesystem::path(results_folder_) / "index.html").string(),
                        IndexHtml(station, parts));
}

Result<std::vector<std::uint8_t>> PictureOf(const PointCloud& cloud_in_model, const PartEvaluator& evaluator,
                                            const ReportConfig& config) {
  ASSIGN_OR_RETURN(const std::vector<float> deviation_mm, evaluator.DeviationsMm(cloud_in_model));
  ASSIGN_OR_RETURN(
      DeviationPicture picture,
      DrawDeviations({cloud_in_model.points, cloud_in_model.normals, deviation_mm, evaluator.ModelPoints()},
                     {config.picture_width_px, config.deviation_scale_mm}));
  return std::move(picture.png);
}

}  // namespace forgescan
