#include "services/common/service/service_monitor.h"

#include <spdlog/spdlog.h>

#include "services/common/bus/channels.h"

namespace forgescan {
namespace {

constexpr std::int64_t kPeriodUs = 1'000'000;
constexpr std::int64_t kLossPeriodUs = 10'000;  // as often as the streams look for what is overdue

}  // namespace

ServiceMonitor::ServiceMonitor(StreamHub& hub, std::string name, std::string config_hash)
    : hub_(hub), name_(std::move(name)), config_hash_(std::move(config_hash)) {
  timer_ = hub_.bus().Every(kPeriodUs, [this] { Publish(); });
  loss_timer_ = hub_.bus().Every(kLossPeriodUs, [this] {
    if (hub_.counters().missing != missing_told_) {
      Publish();
    }
  });
  Publish();
}

ServiceMonitor::~ServiceMonitor() {
  hub_.bus().Cancel(timer_);
  hub_.bus().Cancel(loss_timer_);
}

std::int64_t ServiceMonitor::counter(const std::string& name) const {
  const auto found = counters_.find(name);
  return found != counters_.end() ? found->second : 0;
}

void ServiceMonitor::SetState(ServiceState state, const std::string& text) {
  if (state != state_ || text != text_) {
    state_ = state;
    text_ = text;
    Publish();
  }
}

void ServiceMonitor::ReportError(const Error& error) {
  if (error.message != last_error_) {  // the same again and again is counted, not written
    spdlog::warn("{}", error.message);
  }
  last_error_ = error.message;
  Count("errors");
  Publish();
}

void ServiceMonitor::Publish() {
  const BusHealth health = hub_.bus().Health();
  const StreamCounters& streams = hub_.counters();
  fsmsg::service_state_t state{};
  state.utime = hub_.bus().NowUs();
  state.session = hub_.session();
  state.name = name_;
  state.version = FORGESCAN_VERSION;
  state.config_hash = config_hash_;
  state.state = static_cast<std::int8_t>(state_);
  state.text = text_;
  state.last_error = last_error_;
  state.receive_buffer_bytes = health.receive_buffer_bytes;
  state.socket_drops = health.socket_drops;
  state.messages_missing = missing_told_ = streams.missing;
  state.messages_resent = streams.resent;
  state.messages_recovered = streams.recovered;
  state.decode_errors = streams.damaged;
  for (const auto& [name, value] : counters_) {
    state.counters.push_back({name, value});
  }
  state.counters.push_back({"messages_received", streams.delivered});
  state.counters.push_back({"messages_sent", streams.published});
  state.counter_count = static_cast<std::int32_t>(state.counters.size());
  // Sent again in a second, so a refusal needs no answer here.
  [[maybe_unused]] const Status sent = PublishState(hub_.bus(), kServiceState, state);
  if (on_publish_) {
    on_publish_(text_);
  }
}

}  // namespace forgescan
