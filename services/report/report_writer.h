// Puts reports into the results folder and the history: report.json at once, the page with its picture
// afterwards.
#pragma once

#include <string>

#include "services/report/history.h"
#include "services/report/part_evaluator.h"
#include "services/report/part_report.h"
#include "services/report/report_config.h"

namespace forgescan {

// "20260301T081527Z-part-000012": sorts by time, and no two parts share it even if the line counts from 1
// again.
std::string ReportFolderName(int part, std::int64_t utime);

class ReportWriter {
 public:
  // Makes the folder if there is none. Errors: kIo (it cannot be made); as History::Open.
  static Result<ReportWriter> Open(const std::string& results_folder, const ReportConfig& config);

  // Appends the part to the history. Errors: as History::Append.
  Status Remember(const PartReport& report, std::int64_t utime);
  // The last parts of each dimension of the report. Errors: as History::LastValues.
  Result<std::vector<ReportedTrend>> Trends(const PartReport& report) const;

  // Errors: as WriteWholeFile.
  Status WriteJson(const PartReport& report, const std::string& folder_name) const;
  Status WritePage(const PartReport& report, const std::string& folder_name) const;
  Status WriteIndex(const std::string& station) const;

 private:
  ReportWriter(std::string results_folder, History history, const ReportConfig& config);

  std::string results_folder_;
  History history_;
  ReportConfig config_;
};

// The picture of a registered cloud. Errors: as PartEvaluator::DeviationsMm and DrawDeviations.
Result<std::vector<std::uint8_t>> PictureOf(const PointCloud& cloud_in_model, const PartEvaluator& evaluator,
                                            const ReportConfig& config);

}  // namespace forgescan
