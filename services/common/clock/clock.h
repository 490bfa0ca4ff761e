// The one clock. Everything that needs the time gets it from a Clock (or from the Bus, which has one).
#pragma once

#include <cstdint>

namespace forgescan {

class Clock {
 public:
  virtual ~Clock() = default;
  // us since 1970 UTC; never steps back within a process.
  virtual std::int64_t NowUs() const = 0;
};

// The host's time of day at construction, continued by its steady clock: an NTP step does not reach the
// services.
class RealClock final : public Clock {
 public:
  RealClock();
  std::int64_t NowUs() const override;

 private:
  std::int64_t offset_us_;  // time of day - steady time
};

}  // namespace forgescan
