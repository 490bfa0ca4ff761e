#include "services/common/bus/lcm_bus.h"

#include <lcm/lcm.h>
#include <poll.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <fstream>

#include "services/common/bus/lcm_socket.h"

namespace forgescan {
namespace {

// Messages handled in one turn before timers and devices get theirs.
constexpr int kMessagesPerTurn = 256;

Result<int> PortOf(const std::string& url) {
  constexpr std::string_view kScheme = "udpm://";
  const std::size_t colon = url.find(':', kScheme.size());
  int port = 0;
  if (url.starts_with(kScheme) && colon != std::string::npos) {
    std::from_chars(url.data() + colon + 1, url.data() + url.size(), port);
  }
  if (port < 1 || port > 65535) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "bus \"{}\" is not of the form udpm://GROUP:PORT?ttl=0&recv_buf_size=BYTES with a port of 1 to 65535",
        url);
  }
  return port;
}

// The URL with recv_buf_size no larger than the kernel allows: LCM would print a warning that names no
// remedy, and what the socket got is read back and judged anyway.
std::string WithAllowedBuffer(const std::string& url) {
  static const std::string kKey = "recv_buf_size=";
  const std::size_t at = url.find(kKey);
  std::ifstream limit_file("/proc/sys/net/core/rmem_max");
  std::int64_t limit = 0, wanted = 0;
  if (at == std::string::npos || !(limit_file >> limit)) {
    return url;
  }
  const char* begin = url.data() + at + kKey.size();
  const char* end = std::from_chars(begin, url.data() + url.size(), wanted).ptr;
  return url.substr(0, at + kKey.size()) + std::to_string(std::min(wanted, limit)) +
         std::string(end, url.data() + url.size());
}

// LCM takes channel names as regular expressions.
std::string Escaped(std::string_view channel) {
  std::string text;
  for (const char c : channel) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') {
      text += '\\';
    }
    text += c;
  }
  return text;
}

}  // namespace

struct LcmBus::Subscription {
  MessageHandler handler;
  lcm_subscription_t* held_by_lcm = nullptr;

  static void OnMessage(const lcm_recv_buf_t* buffer, const char*, void* self) {
    static_cast<Subscription*>(self)->handler(
        ByteView(static_cast<const std::uint8_t*>(buffer->data), buffer->data_size));
  }
};

Result<std::unique_ptr<LcmBus>> LcmBus::Open(const std::string& url) {
  ASSIGN_OR_RETURN(const int port, PortOf(url));
  lcm_t* lcm = lcm_create(WithAllowedBuffer(url).c_str());
  if (lcm == nullptr) {
    return Fail(ErrorCode::kUnavailable,
                "bus {}: cannot be opened; is there a multicast route? (ip route add 239.255.76.67/32 dev "
                "lo, and 239.74.163.2/32 for CAN over UDP, or run it under tools/with-network)",
                url);
  }
  return std::unique_ptr<LcmBus>(new LcmBus(lcm, port));
}

LcmBus::LcmBus(_lcm_t* lcm, int port) : lcm_(lcm) {
  // LCM opens its receiving socket with the first subscription.
  lcm_subscription_t* probe = lcm_subscribe(
      lcm_, "FORGESCAN_PROBE", [](const lcm_recv_buf_t*, const char*, void*) {}, nullptr);
  if (const auto socket = FindLcmSocket(port); socket.ok()) {
    socket_inode_ = socket->inode;
    receive_buffer_bytes_ = socket->receive_buffer_bytes;
  }
  lcm_unsubscribe(lcm_, probe);
}

LcmBus::~LcmBus() { lcm_destroy(lcm_); }

Status LcmBus::Publish(std::string_view channel, ByteView message) {
  RETURN_IF_ERROR(CheckPublish(channel, message));
  const std::string name(channel);
  if (lcm_publish(lcm_, name.c_str(), message.data(), static_cast<unsigned>(message.size())) != 0) {
    return Fail(ErrorCode::kIo, "{}: the network refused a message of {} bytes", channel, message.size());
  }
  return {};
}

Bus::SubscriptionId LcmBus::Subscribe(const std::string& channel, MessageHandler handler) {
  auto held = std::make_unique<Subscription>(Subscription{std::move(handler)});
  held->held_by_lcm = lcm_subscribe(lcm_, Escaped(channel).c_str(), &Subscription::OnMessage, held.get());
  // Unlimited: LCM's default drops the newest in silence.
  lcm_subscription_set_queue_capacity(held->held_by_lcm, 0);
  subscriptions_[++last_subscription_] = std::move(held);
  return last_subscription_;
}

void LcmBus::Unsubscribe(SubscriptionId subscription) {
  if (const auto found = subscriptions_.extract(subscription); !found.empty()) {
    lcm_unsubscribe(lcm_, found.mapped()->held_by_lcm);
  }
}

Bus::TimerId LcmBus::At(std::int64_t utime, TimerHandler handler) {
  return timers_.Add(utime, 0, std::move(handler));
}

Bus::TimerId LcmBus::Every(std::int64_t period_us, TimerHandler handler) {
  return timers_.Add(NowUs() + period_us, period_us, std::move(handler));
}

void LcmBus::Cancel(TimerId timer) { timers_.Cancel(timer); }

BusHealth LcmBus::Health() const { return {receive_buffer_bytes_, SocketDrops(socket_inode_)}; }

void LcmBus::Watch(int fd, std::function<void()> handler) { watches_[fd] = std::move(handler); }

void LcmBus::HandleMessages() {
  // All that has arrived goes before the timers, so that a late turn does not look like a lost message.
  for (int i = 0; i < kMessagesPerTurn && !stopped_; ++i) {
    if (lcm_handle_timeout(lcm_, 0) <= 0) {
      return;  // 0 = nothing left, negative = interrupted by a signal
    }
  }
}

Status LcmBus::RunOnce(std::int64_t timeout_us) {
  std::vector<pollfd> fds{{lcm_get_fileno(lcm_), POLLIN, 0}};
  for (const auto& [fd, handler] : watches_) {
    fds.push_back({fd, POLLIN, 0});
  }
  if (const auto due = timers_.NextDue(); due.has_value()) {
    timeout_us = std::clamp<std::int64_t>(*due - NowUs(), 0, timeout_us);
  }
  const timespec timeout{timeout_us / 1'000'000, timeout_us % 1'000'000 * 1000};
  if (ppoll(fds.data(), fds.size(), &timeout, nullptr) < 0 && errno != EINTR) {
    return Fail(ErrorCode::kIo, "waiting for the bus failed: errno {}", errno);
  }
  HandleMessages();
  for (std::size_t i = 1; i < fds.size() && !stopped_; ++i) {
    if (fds[i].revents != 0) {
      watches_[fds[i].fd]();
    }
  }
  const std::int64_t now_us = NowUs();
  while (!stopped_ && timers_.RunOne(now_us)) {
  }
  return {};
}

Status LcmBus::Run() {
  while (!stopped_) {
    RETURN_IF_ERROR(RunOnce(100'000));
  }
  return {};
}

}  // namespace forgescan
