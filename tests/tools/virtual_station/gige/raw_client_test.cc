// The virtual camera as a raw UDP client sees it.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/tools/virtual_station/gige/gvcp_command.h"
#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/gige_device.h"
#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/gvsp.h"
#include "tools/virtual_station/gige/registers.h"
#include "tools/virtual_station/gige/socket.h"

namespace forgescan::gige {
namespace {

// A client that sends what it is told and shows what comes back.
class RawClient {
 public:
  RawClient() : socket_(UdpSocket::Bind(0x7f000001, 0, false).value()) {
    const timeval patience{5, 0};
    ::setsockopt(socket_.fd(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  void Send(const Bytes& bytes) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(0x7f000001);
    to.sin_port = htons(kGvcpPort);
    ASSERT_EQ(::sendto(socket_.fd(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                       sizeof to),
              static_cast<ssize_t>(bytes.size()));
  }
  Bytes Receive() {
    Bytes bytes(65536);
    const ssize_t size = ::recv(socket_.fd(), bytes.data(), bytes.size(), 0);
    bytes.resize(size > 0 ? static_cast<std::size_t>(size) : 0U);
    return bytes;
  }
  Bytes Ask(GvcpOperation operation, const std::vector<std::uint32_t>& words) {
    Send(Command(operation, words));
    return Receive();
  }
  // The status of a register write; 0xffff if nothing came back.
  std::uint16_t Write(std::uint32_t address, std::uint32_t value) {
    const Bytes reply = Ask(GvcpOperation::kWriteRegister, {address, value});
    return reply.size() >= 8 ? Get16(reply, 0) : std::uint16_t{0xffff};
  }
  std::uint16_t port() const { return socket_.port(); }

 private:
  UdpSocket socket_;
};

std::unique_ptr<GigeDevice> MakeDevice() {
  GigeDeviceConfig config;
  config.width_px = 64;
  config.height_px = 32;
  config.image = [](std::uint64_t) { return std::make_shared<const Bytes>(Bytes(64 * 32, 9)); };
  auto device = GigeDevice::Create(config);
  EXPECT_TRUE(device.ok()) << device.error().message;
  return std::move(device).value();
}

TEST(RawClient, DiscoveryTellsWhoItIs) {
  const auto device = MakeDevice();
  RawClient client;
  const Bytes reply = client.Ask(GvcpOperation::kDiscovery, {});
  ASSERT_EQ(reply.size(), 8U + kDiscovery_bytes);
  EXPECT_EQ(Get16(reply, 2), 0x0003);
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(&reply[8 + reg::kVendor])), "forgescan");
  EXPECT_EQ(Get32(reply, 8 + reg::kIpAddress), 0x7f000001U);
}

TEST(RawClient, OnlyTheControllerMayWriteAndOnlyUntilItFallsSilent) {
  const auto device = MakeDevice();
  RawClient first;
  RawClient second;
  constexpr auto kDenied = static_cast<std::uint16_t>(GvcpStatus::kAccessDenied);
  EXPECT_EQ(first.Write(reg::kExposureUs, 100), kDenied);
  EXPECT_EQ(first.Write(reg::kControlPrivilege, 2), 0);
  EXPECT_EQ(first.Write(reg::kHeartbeatTimeout, 500), 0);
  EXPECT_EQ(second.Write(reg::kControlPrivilege, 2), kDenied);
  EXPECT_EQ(second.Write(reg::kExposureUs, 100), kDenied);
  while (second.Write(reg::kControlPrivilege, 2) ==
         kDenied) {  // until the heartbeat of `first` has expired, 0.5 s
  }
  EXPECT_EQ(second.Write(reg::kExposureUs, 100), 0);
  EXPECT_EQ(first.Write(reg::kExposureUs, 100), kDenied);
  EXPECT_EQ(device->counters().heartbeats_expired, 1U);
}

TEST(RawClient, BadRequestsAreAnsweredWithTheirReason) {
  const auto device = MakeDevice();
  RawClient client;
  const auto status = [&](GvcpOperation operation, const std::vector<std::uint32_t>& words) {
    return static_cast<GvcpStatus>(Get16(client.Ask(operation, words), 0));
  };
  EXPECT_EQ(status(GvcpOperation::kReadRegister, {0x0a01}), GvcpStatus::kBadAlignment);
  EXPECT_EQ(status(GvcpOperation::kReadRegister, {0xfffffff0}), GvcpStatus::kInvalidAddress);
  EXPECT_EQ(status(GvcpOperation::kReadRegister, {}), GvcpStatus::kInvalidParameter);
  EXPECT_EQ(status(GvcpOperation::kWriteRegister, {1}), GvcpStatus::kInvalidParameter);
  EXPECT_EQ(status(GvcpOperation::kReadMemory, {0, 0xffff}), GvcpStatus::kInvalidParameter);
  EXPECT_EQ(status(GvcpOperation::kWriteMemory, {0}), GvcpStatus::kInvalidParameter);
  EXPECT_EQ(status(static_cast<GvcpOperation>(0x00f0), {}), GvcpStatus::kNotImplemented);
  client.Send(Bytes(3, 0x42));  // no answer
  EXPECT_EQ(status(GvcpOperation::kReadRegister, {reg::kVersion}), GvcpStatus::kSuccess);
  EXPECT_EQ(device->counters().commands_malformed, 1U);
  EXPECT_EQ(device->counters().commands_refused, 7U);
}

TEST(RawClient, TestPacketHasTheStreamsSize) {
  const auto device = MakeDevice();
  RawClient client;
  RawClient stream;
  EXPECT_EQ(client.Write(reg::kControlPrivilege, 2), 0);
  EXPECT_EQ(client.Write(reg::kStreamAddress, 0x7f000001), 0);
  EXPECT_EQ(client.Write(reg::kStreamPort, stream.port()), 0);
  EXPECT_EQ(client.Write(reg::kStreamPacketSize, kFireTestPacket | 9000), 0);
  EXPECT_EQ(stream.Receive().size(), 9000U - kIpUdpHeader_bytes);
  EXPECT_FALSE(device->armed());
}

TEST(GigeDevice, AddressCanBeUsedOnlyOnce) {
  const auto device = MakeDevice();
  GigeDeviceConfig config;
  config.image = [](std::uint64_t) { return nullptr; };
  const auto second = GigeDevice::Create(config);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kIo);
}

TEST(GigeDevice, BadConfigurationIsRefused) {
  GigeDeviceConfig config;
  EXPECT_EQ(GigeDevice::Create(config).error().code, ErrorCode::kInvalidArgument);  // no image source
  config.image = [](std::uint64_t) { return nullptr; };
  config.width_px = 10;
  EXPECT_EQ(GigeDevice::Create(config).error().code, ErrorCode::kInvalidArgument);
  config.width_px = 64;
  config.address = "localhost";
  EXPECT_EQ(GigeDevice::Create(config).error().code, ErrorCode::kInvalidArgument);
  config.address = "127.0.0.1";
  config.first_block_id = 0;
  EXPECT_EQ(GigeDevice::Create(config).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan::gige
