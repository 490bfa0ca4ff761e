// The bus in one process and in simulated time: tests of services and of the whole line run on it, as fast as
// the machine allows and the same every time. A SimNetwork carries the messages between its SimBus nodes, one
// node a service; it can lose, duplicate, delay and reorder them like the real one, from a seed.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "services/common/bus/bus.h"
#include "services/common/bus/timer_queue.h"

namespace forgescan {

struct SimFaults {
  double loss = 0.0;              // probability that a receiver does not get a message, 0..1
  double large_loss = 0.0;        // the same for messages over one datagram (64 kB), in place of `loss`
  double duplicate = 0.0;         // probability that it gets it twice, 0..1
  std::int64_t latency_us = 200;  // of every delivery
  std::int64_t jitter_us = 0;     // uniform, on top; larger than the gap between messages = they overtake
};

class SimBus;

class SimNetwork final : public Clock {
 public:
  explicit SimNetwork(std::uint64_t seed = 1, std::int64_t start_us = 1'700'000'000'000'000);
  ~SimNetwork() override;

  // A new node; it lives as long as the network, or until RemoveNode (a service that dies).
  SimBus& AddNode();
  void RemoveNode(SimBus& node);

  // True if a node has subscribed to the channel.
  bool IsHeard(std::string_view channel) const;
  void SetFaults(const SimFaults& faults) { faults_ = faults; }
  std::int64_t NowUs() const override { return now_us_; }
  // Runs everything due until then; the time is `until_us` afterwards.
  void RunUntil(std::int64_t until_us);
  void RunFor(std::int64_t duration_us) { RunUntil(now_us_ + duration_us); }
  // Runs until the condition holds (true) or `duration_us` has passed (false).
  bool RunUntilTrue(const std::function<bool()>& condition, std::int64_t duration_us);

 private:
  friend class SimBus;
  void Send(const std::string& channel, ByteView message);
  void Deliver(SimBus* node, const std::string& channel, std::shared_ptr<const Bytes> message);
  // Runs the next event if it is due at `until_us`.
  bool Step(std::int64_t until_us);

  std::int64_t now_us_;
  std::mt19937_64 random_;
  SimFaults faults_;
  TimerQueue events_;
  std::vector<std::unique_ptr<SimBus>> nodes_;
};

class SimBus final : public Bus {
 public:
  explicit SimBus(SimNetwork& network) : network_(network) {}
  ~SimBus() override;

  std::int64_t NowUs() const override { return network_.NowUs(); }
  Status Publish(std::string_view channel, ByteView message) override;
  SubscriptionId Subscribe(const std::string& channel, MessageHandler handler) override;
  void Unsubscribe(SubscriptionId subscription) override;
  TimerId At(std::int64_t utime, TimerHandler handler) override;
  TimerId Every(std::int64_t period_us, TimerHandler handler) override;
  void Cancel(TimerId timer) override;
  BusHealth Health() const override { return {}; }

  // What the filter refuses is lost on the way to everybody; the sender does not notice. A node that is to
  // die without another word refuses everything.
  using SendFilter = std::function<bool(std::string_view channel, ByteView message)>;
  void SetSendFilter(SendFilter filter) { send_filter_ = std::move(filter); }
  // Timers that are set and have not run for the last time.
  std::size_t timer_count() const { return timers_.size(); }

 private:
  friend class SimNetwork;
  SimNetwork& network_;
  struct Subscription {
    SubscriptionId id;
    MessageHandler handler;
  };
  std::multimap<std::string, Subscription, std::less<>> handlers_;  // by channel
  SubscriptionId last_subscription_ = 0;
  SendFilter send_filter_;
  std::set<TimerId> timers_;  // set by this node, so that they die with it
};

}  // namespace forgescan
