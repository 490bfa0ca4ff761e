#include "services/report/service_tally.h"

#include <algorithm>

namespace forgescan {

void ServiceTally::Note(const fsmsg::service_state_t& state, std::int64_t now_us) {
  const auto [found, first_word] = services_.try_emplace(state.name);
  Service& service = found->second;
  if (first_word) {
    service.missing_before = state.messages_missing;
  }
  std::int64_t& missing = service.missing[state.session];
  missing = std::max(missing, state.messages_missing);
  service.heard_us = now_us;
  service.stopping = state.state == fsmsg::service_state_t::STATE_STOPPING;
}

std::optional<ServiceSums> ServiceTally::Sums() const {
  if (!std::ranges::all_of(expected_, [this](const auto& name) { return services_.contains(name); })) {
    return std::nullopt;
  }
  ServiceSums sums;
  for (const auto& [name, service] : services_) {
    sums.restarts += static_cast<std::int64_t>(service.missing.size()) - 1;
    sums.messages_missing -= service.missing_before;
    for (const auto& [session, missing] : service.missing) {
      sums.messages_missing += missing;
    }
  }
  return sums;
}

bool ServiceTally::HeardSince(std::int64_t since_us) const {
  return std::all_of(services_.begin(), services_.end(), [since_us](const auto& entry) {
    return entry.second.stopping || entry.second.heard_us >= since_us;
  });
}

}  // namespace forgescan
