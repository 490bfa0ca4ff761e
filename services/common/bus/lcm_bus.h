// The bus between processes: LCM over UDP multicast. The only place that knows LCM's library.
//
// One bus is one UDP port (LCM 1.3.1 binds to every address: the same port with another group is the same
// bus).
#pragma once

#include <map>
#include <memory>

#include "services/common/bus/bus.h"
#include "services/common/bus/timer_queue.h"

struct _lcm_t;

namespace forgescan {

// Kernel buffer for one whole view (16 frames of 5 MB) and what comes with it, so that a process may be away
// for that long.
inline constexpr int kWantedReceiveBufferBytes = 200'000'000;

class LcmBus final : public Bus {
 public:
  // `url` as LCM takes it, e.g. udpm://239.255.76.67:7667?ttl=0&recv_buf_size=104857600.
  // Errors: kInvalidArgument (not an udpm URL), kUnavailable (no multicast route).
  static Result<std::unique_ptr<LcmBus>> Open(const std::string& url);
  ~LcmBus() override;

  std::int64_t NowUs() const override { return clock_.NowUs(); }
  Status Publish(std::string_view channel, ByteView message) override;
  SubscriptionId Subscribe(const std::string& channel, MessageHandler handler) override;
  void Unsubscribe(SubscriptionId subscription) override;
  TimerId At(std::int64_t utime, TimerHandler handler) override;
  TimerId Every(std::int64_t period_us, TimerHandler handler) override;
  void Cancel(TimerId timer) override;
  BusHealth Health() const override;

  // Also waits for this file descriptor and calls the handler when it is readable (devices of the same
  // process).
  void Watch(int fd, std::function<void()> handler);
  // Runs handlers until Stop() is called. Errors: kIo (polling failed).
  Status Run();
  void Stop() { stopped_ = true; }
  // One turn of the loop: waits for at most `timeout_us`.
  Status RunOnce(std::int64_t timeout_us);

 private:
  struct Subscription;
  LcmBus(_lcm_t* lcm, int port);
  void HandleMessages();

  RealClock clock_;
  _lcm_t* lcm_;
  std::uint64_t socket_inode_ = 0;
  int receive_buffer_bytes_ = 0;
  TimerQueue timers_;
  std::map<SubscriptionId, std::unique_ptr<Subscription>> subscriptions_;
  SubscriptionId last_subscription_ = 0;
  std::map<int, std::function<void()>> watches_;
  bool stopped_ = false;
};

}  // namespace forgescan
