#include "services/report/service_tally.h"

namespace forgescan {

std::int64_t ServiceTally::messages_missing() const {
  std::int64_t sum = 0;
  for (const auto& [key, missing] : missing_) {
    sum += missing;
  }
  return sum;
}

std::int64_t ServiceTally::restarts() const {
  std::int64_t restarts = 0;
  const std::string* last = nullptr;
  for (const auto& [key, missing] : missing_) {  // sorted by name
    restarts += last != nullptr && *last == key.first ? 1 : 0;
    last = &key.first;
  }
  return restarts;
}

}  // namespace forgescan
