// Makes sure that the bus works on this host without touching the host: where LCM's multicast group is not
// routed to loopback, the process moves into a network namespace of its own that has just that.
#pragma once

#include "services/common/result.h"

namespace forgescan {

// True if datagrams to the groups of LCM and of CAN over UDP leave by loopback.
bool HasMulticastRoute();

// Moves this process (before it has threads) into a new network namespace with loopback and the routes the
// station needs; where the user is not root, into a new user namespace too. Children inherit it. Errors:
// kUnavailable (the kernel does not allow it).
Status EnterPrivateNetwork();

// Moves this process into the network namespace of another one. Errors: kUnavailable, kNotFound.
Status JoinNetworkOf(int pid);

}  // namespace forgescan
