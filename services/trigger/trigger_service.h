// The trigger service: a view is ready -> command the microcontroller -> one exposure message a pulse -> view
// captured.
#pragma once

#include "services/common/bus/channels.h"
#include "services/common/service/service_monitor.h"
#include "services/trigger/trigger_machine.h"

namespace forgescan {

class TriggerService {
 public:
  // Hub, monitor and device must live as long as the service. The caller drains the device's bus. `config`
  // passed Check().
  TriggerService(StreamHub& hub, ServiceMonitor& monitor, Trigger& device, const TriggerConfig& config);
  TriggerService(const TriggerService&) = delete;
  TriggerService& operator=(const TriggerService&) = delete;
  ~TriggerService();

 private:
  std::int64_t Now() const { return hub_.bus().NowUs(); }
  void OnEvent(const TriggerEvent& event);
  void Do(const TriggerMachine::Actions& actions);
  void Do(const TriggerCommand& command);
  void Do(const ExposureRecord& record);
  void Do(const ViewOutcome& outcome);
  void Do(const TriggerNote& note);
  void Note(const Status& status);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  Trigger& device_;
  TriggerMachine machine_;
  Bus::TimerId timer_;
};

}  // namespace forgescan
