#include "services/common/bus/lcm_socket.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace forgescan {
namespace {

bool IsUdpOnPort(int fd, int port) {
  int type = 0;
  socklen_t length = sizeof type;
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &length) != 0 || type != SOCK_DGRAM) {
    return false;
  }
  sockaddr_in address{};
  length = sizeof address;
  return getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
         address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

}  // namespace

Result<LcmSocket> FindLcmSocket(int port) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", ignored)) {
    const std::string name = entry.path().filename().string();
    int fd = -1;
    std::from_chars(name.data(), name.data() + name.size(), fd);
    if (fd < 0 || !IsUdpOnPort(fd, port)) {
      continue;
    }
    LcmSocket socket;
    socklen_t length = sizeof socket.receive_buffer_bytes;
    struct stat status {};
    if (getsockopt(fd, SOL_SOCKET, SO_RCVBUF, &socket.receive_buffer_bytes, &length) == 0 &&
        fstat(fd, &status) == 0) {
      socket.inode = status.st_ino;
      return socket;
    }
  }
  return Fail(ErrorCode::kNotFound, "no UDP socket on port {} in this process", port);
}

std::int64_t SocketDrops(std::uint64_t inode) {
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);  // header
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    const std::vector<std::string> words{std::istream_iterator<std::string>(fields), {}};
    constexpr std::size_t kInode = 9, kDrops = 12;
    if (words.size() > kDrops && words[kInode] == std::to_string(inode)) {
      return std::strtoll(words[kDrops].c_str(), nullptr, 10);
    }
  }
  return 0;
}

}  // namespace forgescan
