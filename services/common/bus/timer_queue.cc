#include "services/common/bus/timer_queue.h"

namespace forgescan {

TimerQueue::Id TimerQueue::Add(std::int64_t due_us, std::int64_t period_us, Handler handler) {
  const Id id = next_++;
  const Key key{due_us, id};
  timers_.emplace(key, Timer{id, period_us, std::move(handler)});
  keys_.emplace(id, key);
  return id;
}

void TimerQueue::Cancel(Id id) {
  const auto found = keys_.find(id);
  if (found != keys_.end()) {
    timers_.erase(found->second);
    keys_.erase(found);
  }
}

std::optional<std::int64_t> TimerQueue::NextDue() const {
  return timers_.empty() ? std::nullopt : std::optional(timers_.begin()->first.first);
}

bool TimerQueue::RunOne(std::int64_t now_us) {
  if (timers_.empty() || timers_.begin()->first.first > now_us) {
    return false;
  }
  auto node = timers_.extract(timers_.begin());
  const Handler handler = node.mapped().handler;  // a copy: the handler may cancel its own timer
  if (node.mapped().period_us > 0) {
    const std::int64_t period = node.mapped().period_us;
    const std::int64_t missed = (now_us - node.key().first) / period;
    const Key key{node.key().first + (missed + 1) * period, next_++};
    keys_[node.mapped().id] = key;
    node.key() = key;
    timers_.insert(std::move(node));
  } else {
    keys_.erase(node.mapped().id);
  }
  handler();
  return true;
}

}  // namespace forgescan
