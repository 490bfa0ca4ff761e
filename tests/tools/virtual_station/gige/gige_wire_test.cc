// The packets, registers and the link of the virtual camera.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tests/tools/virtual_station/gige/gvcp_command.h"
#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/device_xml.h"
#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/gvsp.h"
#include "tools/virtual_station/gige/link.h"
#include "tools/virtual_station/gige/registers.h"

namespace forgescan::gige {
namespace {

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

}  // namespace
}  // namespace forgescan::gige
