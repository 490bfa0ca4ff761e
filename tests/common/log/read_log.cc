#include "tests/common/log/read_log.h"

#include <gtest/gtest.h>
#include <lcm/eventlog.h>

namespace forgescan::testing {

std::vector<LogEvent> ReadLog(const std::string& path) {
  std::vector<LogEvent> events;
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  EXPECT_NE(log, nullptr) << path;
  if (log == nullptr) {
    return events;
  }
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    const auto* data = static_cast<const std::uint8_t*>(event->data);
    events.push_back({event->eventnum, event->timestamp,
                      std::string(event->channel, static_cast<std::size_t>(event->channellen)),
                      Bytes(data, data + event->datalen)});
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  return events;
}

}  // namespace forgescan::testing
