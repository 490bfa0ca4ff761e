#include "services/common/bus/sim_bus.h"

#include <algorithm>

namespace forgescan {
namespace {

constexpr std::size_t kDatagramBytes = 64 * 1024;

bool Happens(std::mt19937_64& random, double probability) {
  return probability > 0.0 && std::uniform_real_distribution<double>(0.0, 1.0)(random) < probability;
}

}  // namespace

SimNetwork::SimNetwork(std::uint64_t seed, std::int64_t start_us) : now_us_(start_us), random_(seed) {}
SimNetwork::~SimNetwork() = default;

SimBus& SimNetwork::AddNode() { return *nodes_.emplace_back(std::make_unique<SimBus>(*this)); }

void SimNetwork::RemoveNode(SimBus& node) {
  std::erase_if(nodes_, [&node](const auto& held) { return held.get() == &node; });
}

bool SimNetwork::IsHeard(std::string_view channel) const {
  return std::any_of(nodes_.begin(), nodes_.end(),
                     [channel](const auto& node) { return node->handlers_.contains(channel); });
}

void SimNetwork::Send(const std::string& channel, ByteView message) {
  const auto shared = std::make_shared<const Bytes>(message.begin(), message.end());
  const double loss = message.size() > kDatagramBytes ? faults_.large_loss : faults_.loss;
  for (const auto& node : nodes_) {
    if (!node->handlers_.contains(channel) || Happens(random_, loss)) {
      continue;
    }
    const int copies = Happens(random_, faults_.duplicate) ? 2 : 1;
    for (int copy = 0; copy < copies; ++copy) {
      const std::int64_t jitter =
          faults_.jitter_us > 0 ? std::uniform_int_distribution<std::int64_t>(0, faults_.jitter_us)(random_)
                                : 0;
      events_.Add(now_us_ + faults_.latency_us + jitter, 0,
                  [this, to = node.get(), channel, shared] { Deliver(to, channel, shared); });
    }
  }
}

void SimNetwork::Deliver(SimBus* node, const std::string& channel, std::shared_ptr<const Bytes> message) {
  const bool alive =
      std::any_of(nodes_.begin(), nodes_.end(), [node](const auto& held) { return held.get() == node; });
  if (!alive) {
    return;
  }
  const auto [first, last] = node->handlers_.equal_range(channel);
  for (auto handler = first; handler != last; ++handler) {
    handler->second.handler(*message);
  }
}

bool SimNetwork::Step(std::int64_t until_us) {
  const auto due = events_.NextDue();
  if (!due.has_value() || *due > until_us) {
    return false;
  }
  now_us_ = std::max(now_us_, *due);
  return events_.RunOne(now_us_);
}

void SimNetwork::RunUntil(std::int64_t until_us) {
  while (Step(until_us)) {
  }
  now_us_ = std::max(now_us_, until_us);
}

bool SimNetwork::RunUntilTrue(const std::function<bool()>& condition, std::int64_t duration_us) {
  const std::int64_t until_us = now_us_ + duration_us;
  while (!condition()) {
    if (!Step(until_us)) {
      now_us_ = until_us;
      return condition();
    }
  }
  return true;
}

SimBus::~SimBus() {
  for (const TimerId timer : timers_) {
    network_.events_.Cancel(timer);
  }
}

Status SimBus::Publish(std::string_view channel, ByteView message) {
  RETURN_IF_ERROR(CheckPublish(channel, message));
  if (send_filter_ && !send_filter_(channel, message)) {
    return {};
  }
  network_.Send(std::string(channel), message);
  return {};
}

Bus::SubscriptionId SimBus::Subscribe(const std::string& channel, MessageHandler handler) {
  handlers_.emplace(channel, Subscription{++last_subscription_, std::move(handler)});
  return last_subscription_;
}

void SimBus::Unsubscribe(SubscriptionId subscription) {
  std::erase_if(handlers_, [subscription](const auto& held) { return held.second.id == subscription; });
}

Bus::TimerId SimBus::At(std::int64_t utime, TimerHandler handler) {
  const auto timer = std::make_shared<TimerId>();  // known only when it is set
  *timer = network_.events_.Add(std::max(utime, NowUs()), 0, [this, timer, handler = std::move(handler)] {
    timers_.erase(*timer);
    handler();
  });
  return *timers_.insert(*timer).first;
}

Bus::TimerId SimBus::Every(std::int64_t period_us, TimerHandler handler) {
  return *timers_.insert(network_.events_.Add(NowUs() + period_us, period_us, std::move(handler))).first;
}

void SimBus::Cancel(TimerId timer) {
  network_.events_.Cancel(timer);
  timers_.erase(timer);
}

}  // namespace forgescan
