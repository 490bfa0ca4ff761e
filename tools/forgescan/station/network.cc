#include "tools/forgescan/station/network.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/route.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace forgescan {
namespace {

// The host part of "SCHEME...HOST:PORT..."; empty if the URL has another scheme.
std::string HostOf(const std::string& url, const std::string& scheme) {
  const std::size_t end = url.find(':', scheme.size());
  return url.starts_with(scheme) && end != std::string::npos ? url.substr(scheme.size(), end - scheme.size())
                                                             : std::string();
}

class Socket {
 public:
  Socket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() { close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

// Asks the kernel by which device it would send; the address a socket gets does not tell, as loopback may
// lend another's.
class Netlink {
 public:
  Netlink() : fd_(socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE)) {}
  ~Netlink() { close(fd_); }
  Netlink(const Netlink&) = delete;
  Netlink& operator=(const Netlink&) = delete;

  bool AskRouteTo(in_addr to) const {
    struct {
      nlmsghdr header;
      rtmsg route;
      rtattr attribute;
      in_addr address;
    } request{};
    request.header.nlmsg_len = sizeof request;
    request.header.nlmsg_type = RTM_GETROUTE;
    request.header.nlmsg_flags = NLM_F_REQUEST;
    request.route.rtm_family = AF_INET;
    request.route.rtm_dst_len = 32;
    request.attribute.rta_type = RTA_DST;
    request.attribute.rta_len = RTA_LENGTH(sizeof to);
    request.address = to;
    return send(fd_, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request);
  }
  // Index of the output device; 0 = there is no route.
  int AnsweredDevice() const {
    alignas(nlmsghdr) std::array<char, 4096> buffer{};
    auto length = static_cast<unsigned>(std::max<ssize_t>(0, recv(fd_, buffer.data(), buffer.size(), 0)));
    auto* header = reinterpret_cast<nlmsghdr*>(buffer.data());
    if (!NLMSG_OK(header, length) || header->nlmsg_type != RTM_NEWROUTE) {
      return 0;
    }
    auto rest = static_cast<unsigned>(RTM_PAYLOAD(header));
    for (auto* entry = RTM_RTA(NLMSG_DATA(header)); RTA_OK(entry, rest); entry = RTA_NEXT(entry, rest)) {
      if (entry->rta_type == RTA_OIF) {
        int device = 0;
        std::memcpy(&device, RTA_DATA(entry), sizeof device);
        return device;
      }
    }
    return 0;
  }

 private:
  int fd_;
};

sockaddr_in Address(const char* text) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(7667);
  inet_pton(AF_INET, text, &address.sin_addr);
  return address;
}

Status Refused(const char* what) {
  return Fail(ErrorCode::kUnavailable, "a private network for the station cannot be made: {}: {}", what,
              std::strerror(errno));
}

Status RaiseLoopback(int fd) {
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  request.ifr_flags = IFF_UP | IFF_RUNNING;
  return ioctl(fd, SIOCSIFFLAGS, &request) == 0 ? Status() : Refused("raising loopback");
}

Status RouteToLoopback(int fd, const char* group) {
  rtentry route{};
  const sockaddr_in to = Address(group), mask = Address("255.255.255.255");
  char device[] = "lo";
  std::memcpy(&route.rt_dst, &to, sizeof to);
  std::memcpy(&route.rt_genmask, &mask, sizeof mask);
  route.rt_flags = RTF_UP | RTF_HOST;
  route.rt_dev = device;
  return ioctl(fd, SIOCADDRT, &route) == 0 ? Status() : Refused("adding a multicast route");
}

// Keeps the user's own identity inside the new user namespace.
Status MapUser(uid_t uid, gid_t gid) {
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream users("/proc/self/uid_map"), groups("/proc/self/gid_map");
  users << "0 " << uid << " 1" << std::flush;
  groups << "0 " << gid << " 1" << std::flush;
  return users.good() && groups.good() ? Status() : Refused("mapping the user");
}

}  // namespace

std::vector<std::string> GroupsOf(const Station& station) {
  std::vector<std::string> groups{HostOf(station.bus_url, "udpm://"), HostOf(station.can_url, "udp:")};
  std::erase(groups, std::string());
  return groups;
}

bool HasMulticastRoute(const std::vector<std::string>& groups) {
  return std::all_of(groups.begin(), groups.end(), [](const std::string& group) {
    const Netlink netlink;
    return netlink.AskRouteTo(Address(group.c_str()).sin_addr) &&
           netlink.AnsweredDevice() == static_cast<int>(if_nametoindex("lo"));
  });
}

Status EnsureNetwork(const std::string& folder) {
  ASSIGN_OR_RETURN(const Station station, Station::Load(folder));
  const std::vector<std::string> groups = GroupsOf(station);
  if (HasMulticastRoute(groups)) {
    return {};
  }
  if (!station.can_url.starts_with("udp:")) {
    return Fail(
        ErrorCode::kUnavailable,
        "station {}: the bus's group is not routed to loopback; ip route add {}/32 dev lo, once a boot",
        station.name, groups.empty() ? "GROUP" : groups.front());
  }
  return EnterPrivateNetwork(groups);
}

Status EnterPrivateNetwork(const std::vector<std::string>& groups) {
  const uid_t uid = getuid();
  const gid_t gid = getgid();
  const int kinds = uid == 0 ? CLONE_NEWNET : CLONE_NEWUSER | CLONE_NEWNET;
  if (unshare(kinds) != 0) {
    return Refused("unshare");
  }
  if (uid != 0) {
    RETURN_IF_ERROR(MapUser(uid, gid));
  }
  const Socket socket;
  RETURN_IF_ERROR(RaiseLoopback(socket.fd()));
  for (const std::string& group : groups) {
    RETURN_IF_ERROR(RouteToLoopback(socket.fd(), group.c_str()));
  }
  return {};
}

Status JoinNetworkOf(int pid) {
  const std::string base = "/proc/" + std::to_string(pid) + "/ns/";
  std::error_code not_running;
  if (std::filesystem::read_symlink(base + "net", not_running) ==
          std::filesystem::read_symlink("/proc/self/ns/net", not_running) &&
      !not_running) {
    return {};
  }
  for (const auto& [kind, flag] : {std::pair{"user", CLONE_NEWUSER}, std::pair{"net", CLONE_NEWNET}}) {
    const int fd = open((base + kind).c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
      return Fail(ErrorCode::kNotFound, "process {} is not running", pid);
    }
    const int outcome = setns(fd, flag);
    const int problem = errno;
    close(fd);
    // Joining the user namespace one is already in is refused with EINVAL, and needed only where it differs.
    if (outcome != 0 && !(flag == CLONE_NEWUSER && problem == EINVAL)) {
      return Fail(ErrorCode::kUnavailable, "the network of process {} cannot be joined: {}", pid,
                  std::strerror(problem));
    }
  }
  return {};
}

}  // namespace forgescan
