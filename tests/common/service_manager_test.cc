// What a service tells systemd, heard on a socket such as systemd's.
#include "services/common/service/service_manager.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstring>

namespace forgescan {
namespace {

// Bound to a path, or to an abstract name if that begins with @.
class Listener {
 public:
  explicit Listener(const std::string& address) : address_(address) {
    sockaddr_un bound{};
    bound.sun_family = AF_UNIX;
    std::memcpy(bound.sun_path, address.data(), address.size());
    if (address[0] == '@') {
      bound.sun_path[0] = '\0';
    }
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size());
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&bound), size), 0);
  }
  ~Listener() {
    close(fd_);
    unlink(address_.c_str());
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  std::string Heard() const {
    std::array<char, 4096> buffer{};
    const ssize_t size = recv(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    return size < 0 ? "nothing" : std::string(buffer.data(), static_cast<std::size_t>(size));
  }

 private:
  std::string address_;
  int fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

class Addresses : public ::testing::TestWithParam<std::string> {};

TEST_P(Addresses, AreHeard) {
  const std::string address = GetParam() + "forgescan_notify_" + std::to_string(getpid());
  const Listener listener(address);
  const auto manager = ServiceManager::Connect(address);
  ASSERT_TRUE(manager.ok()) << manager.error().message;
  EXPECT_TRUE(manager->Notify("READY=1").ok());
  EXPECT_EQ(listener.Heard(), "READY=1");
  EXPECT_TRUE(manager->Notify("WATCHDOG=1\n" + StatusLine("part 3\nREADY=1")).ok());
  EXPECT_EQ(listener.Heard(), "WATCHDOG=1\nSTATUS=part 3 READY=1") << "a text adds no assignment";
}

INSTANTIATE_TEST_SUITE_P(PathAndAbstract, Addresses, ::testing::Values(::testing::TempDir(), "@"));

TEST(ServiceManager, WithoutAnAddressNobodyIsTold) {
  const auto manager = ServiceManager::Connect("");
  ASSERT_TRUE(manager.ok());
  EXPECT_TRUE(manager->Notify("READY=1").ok());
}

TEST(ServiceManager, SaysWhatIsWrongWithAnAddress) {
  for (const std::string& wrong :
       {std::string("relative"), std::string("/"), std::string("@"), "/" + std::string(200, 'x')}) {
    EXPECT_FALSE(ServiceManager::Connect(wrong).ok()) << wrong;
  }
  const auto nobody = ServiceManager::Connect("/no/such/socket");
  ASSERT_FALSE(nobody.ok());
  EXPECT_EQ(nobody.error().code, ErrorCode::kIo);
}

TEST(ServiceManager, AListenerThatLeavesIsAnErrorAndNoSignal) {
  const std::string address = "@forgescan_gone_" + std::to_string(getpid());
  auto listener = std::make_unique<Listener>(address);
  const auto manager = ServiceManager::Connect(address);
  ASSERT_TRUE(manager.ok());
  listener.reset();
  EXPECT_FALSE(manager->Notify("WATCHDOG=1").ok());
}

}  // namespace
}  // namespace forgescan
