// What a service says of itself on SERVICE_STATE: once a second, at every change and at every message given
// up, from its working loop, so that a hung loop goes silent.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "fsmsg/service_state_t.hpp"
#include "services/common/bus/stream_hub.h"

namespace forgescan {

enum class ServiceState : std::int8_t {
  kStarting = fsmsg::service_state_t::STATE_STARTING,
  kReady = fsmsg::service_state_t::STATE_READY,
  kWorking = fsmsg::service_state_t::STATE_WORKING,
  kDegraded = fsmsg::service_state_t::STATE_DEGRADED,
  kError = fsmsg::service_state_t::STATE_ERROR,
  kStopping = fsmsg::service_state_t::STATE_STOPPING,
};

class ServiceMonitor {
 public:
  ServiceMonitor(StreamHub& hub, std::string name, std::string config_hash);
  ServiceMonitor(const ServiceMonitor&) = delete;
  ServiceMonitor& operator=(const ServiceMonitor&) = delete;
  ~ServiceMonitor();

  const std::string& name() const { return name_; }
  ServiceState state() const { return state_; }
  const std::string& last_error() const { return last_error_; }
  std::int64_t counter(const std::string& name) const;

  void SetState(ServiceState state, const std::string& text);
  // Called with the line of text whenever the service speaks, for a supervisor outside the bus.
  void OnPublish(std::function<void(const std::string& text)> handler) { on_publish_ = std::move(handler); }
  // Keeps the sentence as last error, writes it to the log and counts it under `errors`; the state stays as
  // it is.
  void ReportError(const Error& error);
  void SetCounter(const std::string& name, std::int64_t value) { counters_[name] = value; }
  void Count(const std::string& name, std::int64_t by = 1) { counters_[name] += by; }

 private:
  void Publish();

  StreamHub& hub_;
  std::string name_;
  std::string config_hash_;
  ServiceState state_ = ServiceState::kStarting;
  std::string text_;
  std::string last_error_;
  std::map<std::string, std::int64_t> counters_;
  std::int64_t missing_told_ = 0;  // messages given up, as last published
  std::function<void(const std::string&)> on_publish_;
  Bus::TimerId timer_;
  Bus::TimerId loss_timer_;
};

}  // namespace forgescan
