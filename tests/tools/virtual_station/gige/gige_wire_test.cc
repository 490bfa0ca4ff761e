// The packets, registers and the link of the virtual camera, and the camera as a raw UDP client sees it.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/device_xml.h"
#include "tools/virtual_station/gige/gige_device.h"
#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/gvsp.h"
#include "tools/virtual_station/gige/link.h"
#include "tools/virtual_station/gige/registers.h"
#include "tools/virtual_station/gige/socket.h"

namespace forgescan::gige {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes Command(GvcpOperation operation, const std::vector<std::uint32_t>& words, std::uint16_t id = 7) {
  Bytes bytes{0x42, 0x01, 0, 0, 0, 0, 0, 0};
  Put16(bytes, 2, static_cast<std::uint32_t>(operation));
  Put16(bytes, 4, static_cast<std::uint32_t>(words.size() * 4));
  Put16(bytes, 6, id);
  for (const std::uint32_t word : words) {
    Append32(bytes, word);
  }
  return bytes;
}

TEST(Gvcp, CommandIsParsedAndAnswered) {
  const auto command = ParseGvcpCommand(Command(GvcpOperation::kReadRegister, {0x0a00}));
  ASSERT_TRUE(command.ok());
  EXPECT_EQ(command->operation, GvcpOperation::kReadRegister);
  EXPECT_TRUE(command->wants_acknowledge);
  const Bytes payload{1, 2, 3, 4};
  const Bytes expected{0x80, 0x06, 0x00, 0x81, 0x00, 0x04, 0x00, 0x07, 1, 2, 3, 4};
  EXPECT_EQ(MakeGvcpAcknowledge(*command, GvcpStatus::kAccessDenied, payload), expected);
}

TEST(Gvcp, MalformedDatagramsAreErrors) {
  EXPECT_EQ(ParseGvcpCommand(Bytes{}).error().code, ErrorCode::kFormat);
  EXPECT_EQ(ParseGvcpCommand(Bytes(7, 0x42)).error().code, ErrorCode::kFormat);
  EXPECT_EQ(ParseGvcpCommand(Bytes(8, 0x00)).error().code, ErrorCode::kFormat);
  Bytes truncated = Command(GvcpOperation::kReadRegister, {1, 2});
  truncated.pop_back();
  EXPECT_EQ(ParseGvcpCommand(truncated).error().code, ErrorCode::kFormat);
}

TEST(Gvcp, ResendRequestNeedsAnOrderedRange) {
  const auto good =
      ParseResendRequest(*ParseGvcpCommand(Command(GvcpOperation::kPacketResend, {0x00000102, 3, 5})));
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good->block_id, 0x0102);
  EXPECT_EQ(good->first_packet, 3U);
  EXPECT_EQ(good->last_packet, 5U);
  EXPECT_FALSE(ParseResendRequest(*ParseGvcpCommand(Command(GvcpOperation::kPacketResend, {1, 5, 3}))).ok());
  EXPECT_FALSE(ParseResendRequest(*ParseGvcpCommand(Command(GvcpOperation::kPacketResend, {1, 5}))).ok());
}

// Packets 1..n put together are the pixels and then the chunks, whatever the packet size and wherever the
// border falls.
TEST(Gvsp, PacketsCarryTheWholePayloadOnce) {
  for (const std::uint32_t packet_size_bytes : {576U, 580U, 1500U, 9000U}) {
    GvspFrame frame;
    frame.block_id = 0x1234;
    frame.packet_size_bytes = packet_size_bytes;
    Bytes image(5413);
    for (std::size_t i = 0; i < image.size(); ++i) {
      image[i] = static_cast<std::uint8_t>(i % 251);
    }
    frame.image = std::make_shared<const Bytes>(image);
    frame.chunks = MakeChunks({true, true, true, true}, {5413, 1, 2, 3});
    Bytes received;
    for (std::uint32_t id = 1; id <= frame.data_packets(); ++id) {
      const GvspPacket packet = MakePacket(frame, id, PacketStatus::kSuccess);
      EXPECT_LE(packet.udp_bytes() + kIpUdpHeader_bytes, packet_size_bytes);
      EXPECT_EQ(Get16(packet.head, 2), 0x1234);
      EXPECT_EQ(Get32(packet.head, 4), 0x03000000U | id);
      received.insert(received.end(), packet.image_part.begin(), packet.image_part.end());
      received.insert(received.end(), packet.chunk_part.begin(), packet.chunk_part.end());
    }
    Bytes expected = image;
    expected.insert(expected.end(), frame.chunks.begin(), frame.chunks.end());
    EXPECT_EQ(received, expected) << packet_size_bytes;
    EXPECT_EQ(MakePacket(frame, frame.packets() - 1, PacketStatus::kSuccess).head[4], 2);  // trailer
  }
}

TEST(Gvsp, ChunksAreReadFromTheEnd) {
  const Bytes chunks = MakeChunks({true, true, false, true}, {100, 5, 6, 7});
  ASSERT_EQ(chunks.size(), 8U + 16U + 16U);
  EXPECT_EQ(Get32(chunks, 0), kImageChunkId);
  EXPECT_EQ(Get32(chunks, 4), 100U);
  EXPECT_EQ(Get32(chunks, chunks.size() - 8), kExposureChunkId);
  EXPECT_EQ(Get32(chunks, chunks.size() - 12), 7U);
  EXPECT_TRUE(MakeChunks({}, {100, 5, 6, 7}).empty());
}

// 1250 bytes take 10 us at 1 Gbit/s; the buffer holds four such packets.
TEST(SharedLink, DropsWhatDoesNotFitBehindWhatWaits) {
  Link link({1000, 5000});
  EXPECT_EQ(WireTimeNs(1250, 1000), 10'000);
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(link.Admit(1000, 1250)) << i;
  }
  EXPECT_FALSE(link.Admit(1000, 1250));
  EXPECT_TRUE(link.Admit(11'000, 1250));  // one packet has left
  EXPECT_FALSE(link.Admit(11'000, 1250));
  EXPECT_TRUE(link.Admit(1'000'000, 1250));
  EXPECT_EQ(link.admitted(), 6U);
  EXPECT_EQ(link.dropped(), 2U);
}

TEST(SharedLink, OrderOfOfferingDoesNotMatterToPacketsThatDoNotMeet) {
  Link link({1000, 1250});  // no waiting at all: a packet that meets another one is dropped
  for (const std::int64_t t_ns : {50'000, 10'000, 30'000, 0, 20'000, 40'000}) {
    EXPECT_TRUE(link.Admit(t_ns, 1250)) << t_ns;
  }
  for (const std::int64_t t_ns : {0, 5'000, 25'000, 55'000}) {
    EXPECT_FALSE(link.Admit(t_ns, 1250)) << t_ns;
  }
}

TEST(Registers, WritesOutsideTheRulesAreRefused) {
  RegisterFile registers({"v", "m", "s", "u", 1, 0x7f000001}, 640, 512, true);
  EXPECT_EQ(registers.Write(reg::kWidth, 320), GvcpStatus::kSuccess);
  EXPECT_EQ(registers.Write(reg::kWidth, 644), GvcpStatus::kInvalidParameter);  // sensor has 640
  EXPECT_EQ(registers.Write(reg::kWidth, 322), GvcpStatus::kInvalidParameter);  // step 4
  EXPECT_EQ(registers.Write(reg::kOffsetX, 320), GvcpStatus::kSuccess);
  EXPECT_EQ(registers.Write(reg::kOffsetX, 324), GvcpStatus::kInvalidParameter);
  EXPECT_EQ(registers.Write(reg::kPayloadSize, 1), GvcpStatus::kWriteProtect);
  EXPECT_EQ(registers.Write(0xfffffff0, 1), GvcpStatus::kInvalidAddress);
  EXPECT_EQ(registers.Write(reg::kStreamPacketSize, 100), GvcpStatus::kInvalidParameter);
  EXPECT_EQ(registers.Get(reg::kWidth), 320U);
  EXPECT_EQ(registers.Write(reg::kAcquisition, 1), GvcpStatus::kSuccess);
  EXPECT_EQ(registers.Write(reg::kWidth, 320), GvcpStatus::kBusy);
  EXPECT_FALSE(registers.Read(0xfffffff0, 64).has_value());
  registers.Reset();
  EXPECT_EQ(registers.Get(reg::kWidth), 640U);
}

TEST(Registers, PayloadSizeFollowsRegionAndChunks) {
  RegisterFile registers({"v", "m", "s", "u", 1, 0x7f000001}, 640, 512, true);
  EXPECT_EQ(registers.Get(reg::kPayloadSize), 640U * 512U);
  ASSERT_EQ(registers.Write(reg::kChunkEnable, 1), GvcpStatus::kSuccess);
  EXPECT_EQ(registers.Get(reg::kPayloadSize), 640U * 512U);
  ASSERT_EQ(registers.Write(reg::kChunkActive, 1), GvcpStatus::kSuccess);
  EXPECT_EQ(registers.Get(reg::kPayloadSize), 640U * 512U + 8U + 16U);
}

TEST(Registers, DescriptionIsWhereTheUrlSays) {
  RegisterFile registers({"v", "m", "s", "u", 1, 0x7f000001}, 640, 512, true);
  const std::string xml = MakeDeviceXml({"v", "m", "s", "u", 1, 0x7f000001}, 640, 512);
  EXPECT_EQ(xml.size() % 4, 0U);
  const auto url = registers.Read(reg::kXmlUrl, 512);
  ASSERT_TRUE(url.has_value());
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(url->data())),
            fmt::format("Local:camera.xml;10000;{:x}", xml.size()));
  const auto stored = registers.Read(reg::kXml, static_cast<std::uint32_t>(xml.size()));
  ASSERT_TRUE(stored.has_value());
  EXPECT_TRUE(std::equal(stored->begin(), stored->end(), xml.begin(), [](std::uint8_t byte, char letter) {
    return byte == static_cast<std::uint8_t>(letter);
  }));
}

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
