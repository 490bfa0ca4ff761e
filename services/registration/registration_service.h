// The registration service: where the part lies, with the foreign points taken out, or why that is not known.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "fsmsg/fusion_result_t.hpp"
#include "fsmsg/registration_t.hpp"
#include "services/common/aged_map.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/service/service_monitor.h"
#include "services/registration/registration_config.h"

namespace forgescan {

class RegistrationService {
 public:
  RegistrationService(StreamHub& hub, ServiceMonitor& monitor, RegistrationConfig config,
                      RegistrationModel model);

 private:
  struct Part {
    std::optional<PointCloud> cloud_in_array;
    std::optional<fsmsg::fusion_result_t> fusion;
    std::string lost;  // the last slices the bus gave up while the part waited; empty = none
  };

  // Number and time of the scan's end: a line that counts from 1 again makes other parts with old numbers.
  using Key = std::pair<int, std::int64_t>;

  Part& InWork(Key key);
  void OnLost(std::int64_t first, std::int64_t last);
  void OnFusion(const fsmsg::fusion_result_t& fusion);
  void OnSlice(const fsmsg::cloud_slice_t& slice);
  void FinishIfComplete(Key key);
  // The part's cloud did not come in time: says so, instead of nothing.
  void GiveUp(Key key);
  void Finish(const fsmsg::fusion_result_t& fusion, const PointCloud& cloud_in_array);
  // Fills the message from a registration, or with the reason why there is none; returns the part's points.
  PointCloud Register(const PointCloud& cloud_in_array, fsmsg::registration_t& message) const;
  Status Publish(const fsmsg::registration_t& message, const PointCloud& cloud_in_model);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  RegistrationConfig config_;
  RegistrationModel model_;
  CloudAssembler assembler_;
  AgedMap<Key, Part> parts_;  // in work
};

}  // namespace forgescan
