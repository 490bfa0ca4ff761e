// A CAN bus inside one process, in simulated time, that can fail like a real one. For tests and the virtual
// station.
#pragma once

#include <map>
#include <memory>
#include <random>

#include "drivers/can/can_bus.h"

namespace forgescan {

// What goes wrong, each delivery to each station for itself. Probabilities 0..1; the seed makes a run
// repeatable.
struct CanFaults {
  double loss = 0;
  double duplicate = 0;
  double reorder = 0;             // probability of being held back by up to max_delay_us, behind later frames
  std::int64_t max_delay_us = 0;  // upper end of the uniform delay of a held-back frame
  std::int64_t latency_us = 250;  // every frame: about 8 data bytes at 500 kbit/s
  std::uint64_t seed = 1;

  // Errors: kInvalidArgument when a probability is outside 0..1 or a time negative.
  Status Check() const;
};

// The wire. It has no clock: StepTo moves its time and puts what is due into the stations' queues; each
// station hands its queue to its handlers in Drain, as a driver does with a socket. Stations must not outlive
// the wire.
class InProcessCan {
 public:
  // An invalid `faults` is a bug of the caller: Check it first.
  explicit InProcessCan(const CanFaults& faults = {}, std::int64_t start_utime = 0);
  ~InProcessCan();

  // A station on the wire. It hears all other stations, not itself.
  std::unique_ptr<CanBus> Attach();

  // Delivers all frames due up to and including this time, in the order of their delivery. Earlier times are
  // ignored.
  void StepTo(std::int64_t utime);
  std::int64_t now_us() const { return now_us_; }

  void SetFaults(const CanFaults& faults) { faults_ = faults; }

  // While off, every Send fails with kUnavailable and frames under way are lost; every station hears one
  // error frame at the change to off.
  void SetBusOff(bool off);

 private:
  class Station;
  friend class Station;

  Status Transmit(const Station* sender, CanFrame frame);
  void Schedule(Station* receiver, const CanFrame& frame);
  double Draw() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  CanFaults faults_;
  std::mt19937_64 random_;
  std::int64_t now_us_;
  bool bus_off_ = false;
  std::vector<Station*> stations_;
  std::multimap<std::int64_t, std::pair<Station*, CanFrame>>
      under_way_;  // by time of delivery, then by time of sending
};

}  // namespace forgescan
