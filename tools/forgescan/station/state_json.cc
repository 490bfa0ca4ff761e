// The table of a station for other programs.
#include <nlohmann/json.hpp>

#include "tools/forgescan/station/state_table.h"

namespace forgescan {
namespace {

using OrderedJson = nlohmann::ordered_json;
using State = fsmsg::service_state_t;

template <typename Number>
OrderedJson OrNull(const std::optional<Number>& number) {
  return number.has_value() ? OrderedJson(*number) : OrderedJson(nullptr);
}

const char* NameOf(std::int8_t state) {
  constexpr const char* kNames[] = {"UNKNOWN",  "STARTING", "READY",   "WORKING",
                                    "DEGRADED", "ERROR",    "STOPPING"};
  return state >= 0 && state < 7 ? kNames[state] : "UNKNOWN";
}

OrderedJson Said(const State& state) {
  OrderedJson json{{"version", state.version},
                   {"config_hash", state.config_hash},
                   {"text", state.text},
                   {"last_error", state.last_error},
                   {"receive_buffer_bytes", state.receive_buffer_bytes},
                   {"socket_drops", state.socket_drops},
                   {"messages_missing", state.messages_missing},
                   {"messages_resent", state.messages_resent},
                   {"messages_recovered", state.messages_recovered},
                   {"decode_errors", state.decode_errors}};
  for (const auto& counter : state.counters) {
    json["counters"][counter.name] = counter.value;
  }
  return json;
}

}  // namespace

std::string StateTable::Json(const std::vector<TableRow>& rows) const {
  OrderedJson table = OrderedJson::object();
  for (const TableRow& row : rows) {
    OrderedJson& service = table[row.service];
    service["given_up"] = row.given_up;
    service["restarts"] = OrNull(row.restarts);
    service["cpu_percent"] = OrNull(row.usage ? row.usage->cpu_percent : std::nullopt);
    service["memory_mb"] = OrNull(row.usage ? std::optional(row.usage->memory_mb) : std::nullopt);
    service["peak_memory_mb"] = OrNull(row.usage ? std::optional(row.usage->peak_memory_mb) : std::nullopt);
    const auto found = states_.find(row.service);
    if (found == states_.end()) {
      service["state"] = nullptr;
      continue;
    }
    const Rates rates = RatesOf(row.service);
    service["state"] = Silent(found->second) ? "SILENT" : NameOf(found->second.state);
    service["age_s"] = static_cast<double>(AgeUs(found->second)) * 1e-6;
    service["in_per_s"] = OrNull(rates.in_per_s);
    service["out_per_s"] = OrNull(rates.out_per_s);
    service.update(Said(found->second));
  }
  return table.dump(1, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace forgescan
