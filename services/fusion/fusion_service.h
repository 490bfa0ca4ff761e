// The fusion service: one fused cloud a part, or the reason why there is none.
#pragma once

#include "fsmsg/view_ready_t.hpp"
#include "services/common/aged_map.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/service/service_monitor.h"
#include "services/fusion/fuse.h"
#include "services/fusion/fusion_config.h"
#include "services/fusion/part_collector.h"
#include "services/fusion/visit_correction.h"

namespace forgescan {

// What the files of a station say.
struct FusionFiles {
  ViewMatrices matrices;
  ExpansionCurve curve;
  std::optional<VisitCorrection> correction;  // nothing: the station has no standing surfaces
};

class FusionService {
 public:
  FusionService(StreamHub& hub, ServiceMonitor& monitor, FusionConfig config, FusionFiles files);

 private:
  // A part that has its result.
  struct Finished {
    std::int64_t utime = 0;  // of the end of the scan
    bool arrived = false;    // its arrival was seen
  };

  // The part a message belongs to. Nothing if that has its result, or is an earlier one with the number: what
  // still comes of it must not begin it again.
  template <typename Message>
  PartCollector* Part(const Message& message);
  PartCollector& Begin(int part);
  // The part never finished, and another with its number has come.
  void Drop(int part);
  // Drops what is left of an earlier part with the number. True if there was one.
  bool EndEarlierPart(const fsmsg::part_arrived_t& arrived);
  void OnArrived(const fsmsg::part_arrived_t& arrived);
  void OnViewReady(const fsmsg::view_ready_t& ready);
  void OnCloudSlice(const fsmsg::cloud_slice_t& slice);
  // The robot's error when this cloud was taken, counted and named; the error voids the view.
  Result<Eigen::Isometry3d> Correct(int part, int view, const PointCloud& cloud);
  void OnScanComplete(const fsmsg::scan_complete_t& scan);
  void FinishIfSettled(int part);
  void Finish(int part, PartCollector& collector);
  // Why the part cannot be inspected; empty = it can.
  std::string VoidReason(const PartCollector& collector, const PartCollector::Views& views) const;
  void Publish(fsmsg::fusion_result_t result, const PointCloud& cloud);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  FusionConfig config_;
  FusionFiles files_;
  CloudAssembler assembler_;
  AgedMap<int, PartCollector> parts_;  // in work
  AgedMap<int, Finished> finished_;
};

}  // namespace forgescan
