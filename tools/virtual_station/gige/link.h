// Link: the one network link into the host that several cameras share, as a switch port with a shallow
// buffer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>

namespace forgescan {

struct LinkOptions {
  double rate_mbit_s = 1000;
  std::size_t buffer_bytes = 512 * 1024;  // what the port can hold while it is busy; more is dropped
};

// Thread-safe. The buffer drains at the link's rate; a packet is admitted if it fits behind what still waits.
// Time is the moment at which the packet's first bit would leave the camera, so a late thread does not change
// what is dropped.
class Link {
 public:
  explicit Link(LinkOptions options) : options_(options) {}

  bool Admit(std::int64_t t_mono_ns, std::size_t wire_bytes);

  std::uint64_t admitted() const;
  std::uint64_t dropped() const;

 private:
  const LinkOptions options_;
  mutable std::mutex mutex_;
  std::int64_t free_at_ns_ = 0;  // when all that was admitted will have left
  std::uint64_t admitted_ = 0;
  std::uint64_t dropped_ = 0;
};

// Time on the wire. rate_mbit_s <= 0: no limit.
std::int64_t WireTimeNs(std::size_t wire_bytes, double rate_mbit_s);

}  // namespace forgescan
