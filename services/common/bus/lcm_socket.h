// What LCM 1.3.1 does not tell: the kernel's view of the UDP socket it receives on.
#pragma once

#include <cstdint>

#include "services/common/result.h"

namespace forgescan {

struct LcmSocket {
  int receive_buffer_bytes = 0;  // SO_RCVBUF as the kernel reports it: twice the payload it was asked for
  std::uint64_t inode = 0;
};

// Finds this process's UDP socket bound to the port. Errors: kNotFound.
Result<LcmSocket> FindLcmSocket(int port);

// Datagrams the kernel has dropped at the socket since it was opened (last column of /proc/net/udp); 0 if it
// is gone.
std::int64_t SocketDrops(std::uint64_t inode);

}  // namespace forgescan
