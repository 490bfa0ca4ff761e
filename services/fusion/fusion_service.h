// The fusion service: one fused cloud a part, or the reason why there is none.
#pragma once

#include <map>

#include "services/common/bus/cloud_stream.h"
#include "services/common/service/service_monitor.h"
#include "services/fusion/fuse.h"
#include "services/fusion/fusion_config.h"
#include "services/fusion/part_collector.h"

namespace forgescan {

class FusionService {
 public:
  FusionService(StreamHub& hub, ServiceMonitor& monitor, FusionConfig config, ViewMatrices matrices,
                ExpansionCurve curve);

 private:
  PartCollector& Part(int part);
  void OnCloudSlice(const fsmsg::cloud_slice_t& slice);
  void OnScanComplete(const fsmsg::scan_complete_t& scan);
  void FinishIfSettled(int part);
  void Finish(int part, PartCollector& collector);
  // Why the part cannot be inspected; empty = it can.
  std::string VoidReason(const PartCollector& collector, const PartCollector::Views& views) const;
  void Publish(fsmsg::fusion_result_t result, const PointCloud& cloud);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  FusionConfig config_;
  ViewMatrices matrices_;
  ExpansionCurve curve_;
  CloudAssembler assembler_;
  std::map<int, PartCollector> parts_;  // in work
};

}  // namespace forgescan
