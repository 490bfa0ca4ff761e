// The pace of a camera's port.
#include "tools/virtual_station/gige/transmitter.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <thread>
#include <vector>

#include "tools/virtual_station/gige/mono_time.h"
#include "tools/virtual_station/gige/socket.h"

namespace forgescan::gige {
namespace {

constexpr double kRate_mbit_s = 100;  // a packet of 1500 bytes every 0.12 ms
constexpr std::int64_t kPatience_ns = 10'000'000'000;
constexpr std::int64_t kAhead_ns =
    1'000'000;  // packets of 0.5 ms leave together; as much again for rounding up

// A frame of 412 packets to a port where nobody reads: what the receiver would lose is not the question here.
std::shared_ptr<const GvspFrame> FrameTo(const UdpSocket& receiver) {
  auto frame = std::make_shared<GvspFrame>();
  frame->block_id = 7;
  frame->ready_ns = MonoNowNs();
  frame->width_px = 1000;
  frame->height_px = 600;
  frame->image = std::make_shared<const std::vector<std::uint8_t>>(600'000);
  frame->packet_size_bytes = 1500;
  frame->target.sin_family = AF_INET;
  frame->target.sin_addr.s_addr = htonl(0x7f000001);
  frame->target.sin_port = htons(receiver.port());
  return frame;
}

std::int64_t PacketNs(const GvspFrame& frame) {
  return WireTimeNs(MakePacket(frame, 1, PacketStatus::kSuccess).wire_bytes(), kRate_mbit_s);
}

class TransmitterTest : public ::testing::Test {
 protected:
  // Waits until `packets` more have left. At no time may more have left than the wire could carry since
  // `start_ns`.
  void ExpectPaced(std::int64_t start_ns, std::uint64_t packets, std::int64_t packet_ns) {
    const std::uint64_t before = done_;
    std::int64_t ahead_ns = 0;
    while (done_ < before + packets && MonoNowNs() < start_ns + kPatience_ns) {
      std::this_thread::yield();
      done_ = transmitter_.counters().packets;
      const std::int64_t carried_ns = static_cast<std::int64_t>(done_ - before) * packet_ns;
      ahead_ns = std::max(ahead_ns, carried_ns - (MonoNowNs() - start_ns));
    }
    EXPECT_EQ(done_, before + packets);
    EXPECT_LT(ahead_ns, kAhead_ns);
  }

  UdpSocket sender_ = UdpSocket::Bind(0x7f000001, 0, false).value();
  UdpSocket receiver_ = UdpSocket::Bind(0x7f000001, 0, false).value();
  Transmitter transmitter_{sender_.fd(), {.rate_mbit_s = kRate_mbit_s, .link = nullptr, .seed = 1}};
  std::uint64_t done_ = 0;
};

TEST_F(TransmitterTest, AFrameKeepsThePaceOfTheWire) {
  const std::int64_t start_ns = MonoNowNs();
  const auto frame = FrameTo(receiver_);
  ASSERT_TRUE(transmitter_.Submit(frame));
  ExpectPaced(start_ns, frame->packets(), PacketNs(*frame));
}

TEST_F(TransmitterTest, ResendsKeepThePaceOfTheWire) {
  const std::int64_t start_ns = MonoNowNs();
  const auto frame = FrameTo(receiver_);
  ASSERT_TRUE(transmitter_.Submit(frame));
  ExpectPaced(start_ns, frame->packets(), PacketNs(*frame));
  const std::int64_t resend_ns = MonoNowNs();
  transmitter_.RequestResend({.block_id = 7, .first_packet = 0, .last_packet = frame->packets() - 1});
  ExpectPaced(resend_ns, frame->packets(), PacketNs(*frame));
  EXPECT_EQ(transmitter_.counters().packets_resent, frame->packets());
}

TEST_F(TransmitterTest, ResendsAndTheNextFrameShareTheWire) {
  const std::int64_t start_ns = MonoNowNs();
  const auto frame = FrameTo(receiver_);
  ASSERT_TRUE(transmitter_.Submit(frame));
  ExpectPaced(start_ns, frame->packets(), PacketNs(*frame));
  const std::int64_t second_ns = MonoNowNs();
  ASSERT_TRUE(transmitter_.Submit(FrameTo(receiver_)));
  transmitter_.RequestResend({.block_id = 7, .first_packet = 1, .last_packet = 200});
  ExpectPaced(second_ns, frame->packets() + 200, PacketNs(*frame));
}

// A request may name any packet up to 2^24; what it costs is bounded all the same.
TEST_F(TransmitterTest, AnAbsurdResendRequestIsAnsweredInPart) {
  const std::int64_t start_ns = MonoNowNs();
  const auto frame = FrameTo(receiver_);
  ASSERT_TRUE(transmitter_.Submit(frame));
  ExpectPaced(start_ns, frame->packets(), PacketNs(*frame));
  transmitter_.SetFaults(0, true);
  transmitter_.RequestResend({.block_id = 7, .first_packet = 0, .last_packet = 0xffffff});
  transmitter_.RequestResend({.block_id = 99, .first_packet = 5, .last_packet = 0xffffff});
  const std::uint64_t answers = frame->packets() + 32;
  const std::int64_t asked_ns = MonoNowNs();
  while (transmitter_.counters().resends_unavailable < answers && MonoNowNs() < asked_ns + kPatience_ns) {
    std::this_thread::yield();
  }
  transmitter_.SetFaults(0, false);
  transmitter_.RequestResend({.block_id = 7, .first_packet = 1, .last_packet = 1});
  while (transmitter_.counters().packets_resent < 1 && MonoNowNs() < asked_ns + kPatience_ns) {
    std::this_thread::yield();
  }
  EXPECT_EQ(transmitter_.counters().resends_unavailable, answers);
  EXPECT_EQ(transmitter_.counters().packets_resent, 1U);
}

}  // namespace
}  // namespace forgescan::gige
