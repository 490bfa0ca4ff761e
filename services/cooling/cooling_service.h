// The cooling service: temperatures in, duty out, COOLING_STATE with the interlock for everyone.
#pragma once

#include "drivers/cooling/cooling.h"
#include "services/common/service/service_monitor.h"
#include "services/cooling/cooling_controller.h"

namespace forgescan {

class CoolingService {
 public:
  // Hub, monitor and unit must live as long as the service. The caller drains the unit's bus.
  CoolingService(StreamHub& hub, ServiceMonitor& monitor, CoolingUnit& unit, const CoolingConfig& config);
  CoolingService(const CoolingService&) = delete;
  CoolingService& operator=(const CoolingService&) = delete;
  ~CoolingService();

 private:
  void OnEvent(const CoolingEvent& event);
  void Tick();
  void Publish(const CoolingOutput& output);
  void ShowState(const CoolingOutput& output);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  CoolingUnit& unit_;
  CoolingConfig config_;
  CoolingController controller_;
  CoolingTemperatures temperatures_;
  bool link_up_ = false;
  Bus::TimerId step_timer_;
  Bus::TimerId tick_timer_;
};

}  // namespace forgescan
