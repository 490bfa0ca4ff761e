// Transmitter: sends frames as GVSP packets at the speed of the camera's link, and again when asked.
//
// Two clocks run in it. The camera's: when each packet leaves by the camera's own schedule; the memory and
// the shared link are judged by it, so that a late image or a busy machine loses nothing that a real camera
// would not. And this machine's: when the packet is really given to the system. A sender that is late catches
// up at twice the camera's speed.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/gvsp.h"
#include "tools/virtual_station/gige/link.h"

namespace forgescan::gige {

struct TransmitterOptions {
  double rate_mbit_s = 1000;   // of the camera's own port; <= 0 sends as fast as the host can
  std::shared_ptr<Link> link;  // shared with other cameras; null: none
  std::uint64_t seed = 1;
};

struct TransmitterCounters {
  std::uint64_t frames = 0;
  std::uint64_t packets = 0;              // given to the system
  std::uint64_t packets_lost = 0;         // by the fault knob
  std::uint64_t packets_refused = 0;      // by the shared link
  std::uint64_t packets_failed = 0;       // by the system
  std::uint64_t packets_resent = 0;       // packets sent again, those that were lost again included
  std::uint64_t resends_unavailable = 0;  // packets answered with "unavailable"
};

// Thread-safe. Holds 4 frames, the one being sent included, and the last 8 that went out.
class Transmitter {
 public:
  // `fd`: a UDP socket that outlives the object.
  Transmitter(int fd, TransmitterOptions options);
  ~Transmitter();

  // false: the camera's memory was full when the frame was exposed, or this machine is seconds behind: not
  // taken.
  bool Submit(std::shared_ptr<const GvspFrame> frame);
  // At most as many packets as the frame has are sent, a few "unavailable" for a frame that is not kept; a
  // request that finds thousands waiting is dropped. `request` is ordered: first <= last.
  void RequestResend(const ResendRequest& request);
  // Drops what waits, what is being sent and what was sent.
  void Forget();
  void SetFaults(double packet_loss_chance, bool resend_unavailable);
  TransmitterCounters counters() const;

 private:
  struct Batch;

  void Run();
  bool StartFrame();
  std::int64_t NextSendNs() const;
  std::shared_ptr<const GvspFrame> FindSent(std::uint16_t block_id) const;
  void SendPaced(Batch& batch, std::int64_t begin_ns);
  void SendSome();
  void ServeResend();
  void Add(Batch& batch, const GvspFrame& frame, const GvspPacket& packet);
  void Send(Batch& batch);

  const int fd_;
  const TransmitterOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::deque<std::shared_ptr<const GvspFrame>> waiting_;
  std::deque<std::shared_ptr<const GvspFrame>> history_;
  std::deque<ResendRequest> resends_;
  std::shared_ptr<const GvspFrame> active_;
  std::uint32_t next_packet_ = 0;
  std::int64_t port_free_ns_ = 0;      // when the camera's port can take the next packet, by its schedule
  std::int64_t host_free_ns_ = 0;      // when this machine may send the next packet
  std::deque<std::int64_t> leave_ns_;  // when each frame in the camera's memory will be gone, by the schedule
  double packet_loss_chance_ = 0;
  bool resend_unavailable_ = false;
  std::mt19937_64 random_;
  TransmitterCounters counters_;
  std::thread thread_;
};

}  // namespace forgescan::gige
