// The report service: collects what the other services say of a part, measures, judges, publishes ONE
// verdict, and keeps the report. Several parts may be in work at once. See README.md for channels and faults.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fsmsg/part_sorted_t.hpp"
#include "fsmsg/processing_time_t.hpp"
#include "fsmsg/service_state_t.hpp"
#include "services/common/aged_map.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/stream_hub.h"
#include "services/common/service/service_monitor.h"
#include "services/report/kept_parts.h"
#include "services/report/part_evaluator.h"
#include "services/report/part_in_work.h"
#include "services/report/report_config.h"
#include "services/report/report_pages.h"
#include "services/report/report_writer.h"
#include "services/report/service_tally.h"

namespace forgescan {

// What of the station a report shows and needs.
struct ReportStation {
  std::string name;
  std::string software_version;
  std::string config_hash;
  std::string results_folder;
  std::vector<std::string> services;  // by name; a loss is known once each of them was heard
};

class ReportService {
 public:
  // `evaluator` outlives the service. Errors: as ReportConfig::Check and ReportWriter::Open.
  static Result<std::shared_ptr<ReportService>> Create(StreamHub& hub, ServiceMonitor& monitor,
                                                       const ReportConfig& config,
                                                       const ReportStation& station,
                                                       const PartEvaluator& evaluator);
  ReportService(const ReportService&) = delete;
  ReportService& operator=(const ReportService&) = delete;
  // Gives the parts in work their verdict, NOT_INSPECTED, and writes the pages that are still due.
  ~ReportService();

 private:
  struct Open {
    PartInWork work;
    Bus::TimerId timeout = 0;
  };
  // A part that has its verdict.
  struct FinishedPart {
    std::int64_t utime = 0;       // of its event
    std::int64_t last_utime = 0;  // no event of it is later
    std::optional<fsmsg::part_arrived_t> arrived;
  };

  // What the service works with; made by Create().
  struct Parts {
    ReportConfig config;
    ReportStation station;
    ReportWriter writer;
  };
  ReportService(StreamHub& hub, ServiceMonitor& monitor, Parts parts, const PartEvaluator& evaluator);
  void Subscribe();
  void SubscribeDurations();

  void OnArrived(const fsmsg::part_arrived_t& message);
  void OnSlice(const fsmsg::cloud_slice_t& message);
  void OnDuration(const fsmsg::processing_time_t& message);
  void OnSorted(const fsmsg::part_sorted_t& message);
  // Says the verdicts again that a robot service started anew may have missed.
  void OnRobotState(const fsmsg::service_state_t& state);
  // Takes up the parts that the service before this one had in work.
  void Resume();
  void ResumePart(int part, const KeptPart& kept);
  static fsmsg::part_arrived_t Arrival(int part, std::int64_t utime);
  // Notes for every part in work that a message of one stream was given up, which may have been its own.
  void OnLoss(bool PartInWork::*hole);
  void CheckLossesLater();

  // Gives an unfinished part with the number its verdict. True if there was an earlier part with it.
  bool EndEarlierPart(const fsmsg::part_arrived_t& arrived);
  // The part in work, opened if it is new; nothing if it has its verdict already, or the message is of an
  // earlier part with the number.
  PartInWork* Find(int part, std::int64_t utime);
  // The part in work whose scan ended then; one whose scan ended earlier gets its verdict. Nothing as above.
  PartInWork* FindScan(int part, std::int64_t end_utime);
  // The part in work, or with its page still due, that a step worked on; nothing as above.
  PartInWork* FindStep(int part, std::int64_t utime);
  // A part that has its verdict was in place from then to then: nothing of it is later, however long it was.
  void NoteScan(int part, std::int64_t start_utime, std::int64_t end_utime);
  // The event is of a part that has its verdict.
  bool IsLate(int part, std::int64_t utime);
  PartInWork& OpenPart(int part, std::int64_t utime);
  void FinishIfComplete(int part);
  void Finish(int part);
  void GiveVerdict(int part);
  // What the part lacks was given up: its stream has a hole, and nothing is under way on it any more.
  bool WaitsInVain(const PartInWork& work) const;
  void FinishWhatWaitsInVain();
  PartReport Judge(const PartInWork& work) const;
  void Publish(const PartReport& report, std::int64_t utime);
  void TellState();
  void Note(const Status& status);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  ReportConfig config_;
  ReportStation station_;
  ReportWriter writer_;
  KeptParts kept_;
  const PartEvaluator& evaluator_;
  ServiceTally tally_;
  ReportPages pages_;  // after what it writes with
  CloudAssembler assembler_;
  std::map<int, Open> open_;             // by part
  AgedMap<int, FinishedPart> finished_;  // the last ones, by part
  Bus::TimerId loss_timer_ = 0;          // 0 = none set
  std::int64_t robot_session_ = 0;       // that has been told every verdict; 0 = none
};

}  // namespace forgescan
