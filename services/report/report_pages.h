// Parts that have their verdict but not yet their page: takes what still comes of them, durations and the
// last word of every service on losses, then writes the page and the final report.json.
#pragma once

#include <map>
#include <string>

#include "services/common/bus/bus.h"
#include "services/common/service/service_monitor.h"
#include "services/report/part_evaluator.h"
#include "services/report/part_in_work.h"
#include "services/report/report_config.h"
#include "services/report/report_writer.h"
#include "services/report/service_tally.h"

namespace forgescan {

struct JudgedPart {
  PartInWork work;
  PartReport report;
  std::string folder_name;
};

class ReportPages {
 public:
  // What a page is made with; all outlive the pages.
  struct Means {
    const ReportConfig& config;
    ReportWriter& writer;
    const PartEvaluator& evaluator;
    const ServiceTally& tally;
  };
  ReportPages(Bus& bus, ServiceMonitor& monitor, std::string station_name, Means means);
  ReportPages(const ReportPages&) = delete;
  ReportPages& operator=(const ReportPages&) = delete;
  // Writes the pages that are still due.
  ~ReportPages();

  // Begins the wait for the page; the page of an earlier part with this number is written now.
  void Add(JudgedPart judged);
  // The part with this number whose page is still due; nothing if there is none.
  PartInWork* Find(int part);

 private:
  struct Due {
    JudgedPart judged;
    Bus::TimerId timer = 0;
  };
  void WriteWhenAllAreHeard(int part);
  void Write(int part);
  void Complete(JudgedPart& judged);
  void Note(const Status& status);

  Bus& bus_;
  ServiceMonitor& monitor_;
  std::string station_name_;
  Means means_;
  std::map<int, Due> due_;  // by part
};

}  // namespace forgescan
