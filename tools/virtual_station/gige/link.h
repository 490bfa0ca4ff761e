// Link: the one network link into the host that several cameras share, as a switch port with a shallow
// buffer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>

namespace forgescan {

struct LinkOptions {
  double rate_mbit_s = 1000;
  std::size_t buffer_bytes = 512 * 1024;  // what the port can hold while it is busy; more is dropped
};

// Thread-safe. The port serves packets one after the other at the link's rate; a packet is admitted if it
// fits into the buffer behind what still waits when it arrives. Time is the moment at which the packet would
// leave its camera by the camera's own schedule, so threads that run late, or overtake each other, do not
// change what is dropped.
class Link {
 public:
  explicit Link(LinkOptions options) : options_(options) {}

  // Packets may be offered out of order by up to a second.
  bool Admit(std::int64_t t_mono_ns, std::size_t wire_bytes);

  std::uint64_t admitted() const;
  std::uint64_t dropped() const;

 private:
  void Occupy(std::int64_t begin_ns, std::int64_t end_ns);

  const LinkOptions options_;
  mutable std::mutex mutex_;
  std::map<std::int64_t, std::int64_t> busy_ns_;  // begin -> end of the times in which the port sends, apart
  std::uint64_t admitted_ = 0;
  std::uint64_t dropped_ = 0;
};

// Time on the wire. rate_mbit_s <= 0: no limit.
std::int64_t WireTimeNs(std::size_t wire_bytes, double rate_mbit_s);

}  // namespace forgescan
