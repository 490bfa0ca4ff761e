#include "tools/forgescan/replay/replay_network.h"

#include <algorithm>

#include "services/common/bus/channel_list.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/stream_header.h"

namespace forgescan {

// A service with its place on the network. Members end in reverse order.
struct ReplayNetwork::Host {
  Host(SimNetwork& network, const std::string& name, const std::string& config_hash)
      : bus(network.AddNode()), hub(bus, name), monitor(hub, name, config_hash) {}

  SimBus& bus;
  StreamHub hub;
  ServiceMonitor monitor;
  std::shared_ptr<void> service;
  std::int64_t recorded_session = 0;  // of the service in the record; 0 = not heard yet
  bool recorded_stopping = false;     // its last word was that it stops
};

Result<std::unique_ptr<ReplayNetwork>> ReplayNetwork::Create(const Station& station,
                                                             std::vector<ReplayableService> services,
                                                             std::int64_t start_us, ResultHandler on_result) {
  std::unique_ptr<ReplayNetwork> made(new ReplayNetwork(station, start_us, std::move(on_result)));
  made->services_ = std::move(services);
  for (const ReplayableService& service : made->services_) {
    made->own_channels_.insert(service.results.begin(), service.results.end());
    made->own_channels_.insert(service.durations.begin(), service.durations.end());
    for (const std::string channel : service.results) {
      made->recording_.Subscribe(channel, [network = made.get(), channel](ByteView message) {
        if (!network->muted_) {
          network->on_result_(channel, message);
        }
      });
    }
    RETURN_IF_ERROR(made->Start(service));
  }
  return made;
}

ReplayNetwork::ReplayNetwork(const Station& station, std::int64_t start_us, ResultHandler on_result)
    : network_(1, start_us),
      recording_(network_.AddNode()),
      station_(station),
      on_result_(std::move(on_result)),
      session_(start_us) {
  network_.SetFaults({.latency_us = 0});
}

ReplayNetwork::~ReplayNetwork() = default;

Status ReplayNetwork::Start(const ReplayableService& service) {
  auto host = std::make_unique<Host>(network_, service.name, station_.file.hash());
  ASSIGN_OR_RETURN(host->service, service.make({station_, host->hub, host->monitor}));
  hosts_[service.name] = std::move(host);
  return {};
}

void ReplayNetwork::Stop(const std::string& name) {
  const auto found = hosts_.find(name);
  SimBus& bus = found->second->bus;
  muted_ = !found->second->recorded_stopping;
  hosts_.erase(found);
  network_.RemoveNode(bus);
  network_.RunFor(0);  // what it said last
  muted_ = false;
}

Status ReplayNetwork::OnRecordedState(const fsmsg::service_state_t& state) {
  Host& host = *hosts_.at(state.name);
  if (host.recorded_session != 0 && host.recorded_session != state.session) {
    Stop(state.name);
    const auto service = std::find_if(services_.begin(), services_.end(),
                                      [&state](const auto& known) { return known.name == state.name; });
    RETURN_IF_ERROR(Start(*service));
  }
  Host& running = *hosts_.at(state.name);
  running.recorded_session = state.session;
  running.recorded_stopping = state.state == fsmsg::service_state_t::STATE_STOPPING;
  return {};
}

bool ReplayNetwork::Needs(std::string_view channel) const {
  return network_.IsHeard(channel) && !own_channels_.contains(channel);
}

Status ReplayNetwork::Feed(std::int64_t utime, const std::string& channel, Bytes message,
                           std::int64_t lost_before) {
  network_.RunUntil(utime);
  if (channel == kServiceState.name) {
    const auto state = Decode<fsmsg::service_state_t>(message);
    if (state.ok() && hosts_.contains(state->name)) {
      return OnRecordedState(*state);  // here it speaks for itself
    }
  }
  if (!Needs(channel)) {
    return {};
  }
  if (!IsStateChannel(channel)) {
    std::int64_t& sequence = sequences_[channel];
    sequence += 1 + lost_before;
    RETURN_IF_ERROR(StampStreamHeader(message, {session_, sequence}));
  }
  RETURN_IF_ERROR(recording_.Publish(channel, message));
  network_.RunUntil(utime);
  return {};
}

void ReplayNetwork::Finish() {
  for (const ReplayableService& service : services_) {
    Stop(service.name);
  }
}

}  // namespace forgescan
