// Makes sure that the bus works on this host without touching the host: where LCM's multicast group is not
// routed to loopback, the process moves into a network namespace of its own that has just that.
#pragma once

#include <string>
#include <vector>

#include "services/common/result.h"
#include "services/common/service/station.h"

namespace forgescan {

// The multicast groups a station sends to: of its bus, and of its CAN bus where that is UDP.
std::vector<std::string> GroupsOf(const Station& station);

// True if datagrams to every one of the groups leave by loopback.
bool HasMulticastRoute(const std::vector<std::string>& groups);

// Makes the bus of the station in FOLDER work for this process and its children: nothing to do where its
// groups are routed to loopback, else a network of its own. A station with SocketCAN needs the host's
// network, so there the missing route is an error. Errors: as Station::Load and EnterPrivateNetwork,
// kUnavailable.
Status EnsureNetwork(const std::string& folder);

// Moves this process (before it has threads) into a new network namespace with loopback and routes to the
// groups; where the user is not root, into a new user namespace too. Children inherit it. Errors:
// kUnavailable (the kernel does not allow it).
Status EnterPrivateNetwork(const std::vector<std::string>& groups);

// Moves this process into the network namespace of another one, if it is not there. Errors: kUnavailable,
// kNotFound.
Status JoinNetworkOf(int pid);

}  // namespace forgescan
