// Timers in order of due time, then of setting: the part that LcmBus and SimBus share.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>

namespace forgescan {

class TimerQueue {
 public:
  using Handler = std::function<void()>;
  using Id = std::uint64_t;

  // period_us = 0: once.
  Id Add(std::int64_t due_us, std::int64_t period_us, Handler handler);
  void Cancel(Id id);
  std::optional<std::int64_t> NextDue() const;
  // Runs the first timer if it is due at `now_us`; false = none was.
  bool RunOne(std::int64_t now_us);

 private:
  struct Timer {
    Id id;
    std::int64_t period_us;
    Handler handler;
  };
  using Key = std::pair<std::int64_t, std::uint64_t>;  // due time, order of setting
  std::map<Key, Timer> timers_;
  std::map<Id, Key> keys_;
  std::uint64_t next_ = 1;
};

}  // namespace forgescan
