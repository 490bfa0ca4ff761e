// Streams taken as bytes, by name: what a recorder needs. Whole and in order like any other, with a word for
// every hole, and with what the receiver knows of its sender.
#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_header.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;

struct Hole {
  std::int64_t session, first, last;
};

class StreamRawTest : public ::testing::Test {
 protected:
  void Listen() {
    receiver_.SubscribeRaw(kExposure.name, [this](ByteView bytes) {
      const auto header = CheckStreamHeader(bytes);
      ASSERT_TRUE(header.ok());
      sequences_.push_back(header->sequence);
      bytes_.assign(bytes.begin(), bytes.end());
    });
    receiver_.OnLost(kExposure.name, [this](std::int64_t first, std::int64_t last) {
      holes_.push_back({receiver_.Standing(kExposure.name).session, first, last});
    });
  }
  void Send(StreamHub& sender, int pulse) {
    fsmsg::exposure_t exposure{};
    exposure.pulse = pulse;
    ASSERT_TRUE(sender.Publish(kExposure, exposure).ok());
  }

  SimNetwork network_{5};
  StreamHub receiver_{network_.AddNode(), "receiver"};
  std::vector<std::int64_t> sequences_;
  std::vector<Hole> holes_;
  Bytes bytes_;
};

TEST_F(StreamRawTest, BytesComeAsTheyWereSent) {
  Listen();
  StreamHub sender(network_.AddNode(), "sender");
  Send(sender, 42);
  network_.RunFor(kSecondUs);
  const auto message = Decode<fsmsg::exposure_t>(bytes_);
  ASSERT_TRUE(message.ok());
  EXPECT_EQ(message->pulse, 42);
  EXPECT_EQ(message->session, sender.session());
  EXPECT_EQ(message->sequence, 1);
}

TEST_F(StreamRawTest, InOrderAndCompleteUnderLossAndReordering) {
  Listen();
  network_.SetFaults({.loss = 0.3, .duplicate = 0.3, .jitter_us = 50'000});
  StreamHub sender(network_.AddNode(), "sender");
  sender.Advertise(kExposure);
  std::vector<std::int64_t> sent;
  for (int pulse = 1; pulse <= 50; ++pulse) {
    Send(sender, pulse);
    sent.push_back(pulse);
    network_.RunFor(5'000);
  }
  network_.RunFor(20 * kSecondUs);
  EXPECT_EQ(sequences_, sent);
  EXPECT_TRUE(holes_.empty());
}

TEST_F(StreamRawTest, AHoleBearsTheSessionItIsOf) {
  Listen();
  StreamHub first(network_.AddNode(), "sender");
  Send(first, 1);
  network_.RunFor(kSecondUs);
  network_.SetFaults({.loss = 1.0});
  StreamHub second(network_.AddNode(), "sender", {.history_bytes = 1, .burst_bytes = 1});  // keeps one
  Send(second, 1);
  Send(second, 2);
  network_.RunFor(1000);
  network_.SetFaults({});
  Send(second, 3);
  network_.RunFor(20 * kSecondUs);
  ASSERT_EQ(holes_.size(), 1u);
  EXPECT_EQ(holes_[0].session, second.session()) << "although nothing of it has come before";
  EXPECT_EQ(holes_[0].first, 1);
  EXPECT_EQ(holes_[0].last, 2);
}

TEST_F(StreamRawTest, NothingIsKnownOfASenderNeverHeard) {
  const StreamStanding never = receiver_.Standing(kExposure.name);
  EXPECT_EQ(never.session, 0);
  Listen();
  network_.RunFor(kSecondUs);
  EXPECT_EQ(receiver_.Standing(kExposure.name).joined_at, 0);
  EXPECT_EQ(receiver_.Standing(kExposure.name).told_us, 0);
}

TEST_F(StreamRawTest, KnowsWhereItJoinedASenderThatWasThereBefore) {
  StreamHub sender(network_.AddNode(), "sender");
  for (int pulse = 1; pulse <= 4; ++pulse) {
    Send(sender, pulse);
  }
  network_.RunFor(kSecondUs);
  Listen();
  network_.RunFor(kSecondUs);
  Send(sender, 5);
  network_.RunFor(kSecondUs);
  const StreamStanding standing = receiver_.Standing(kExposure.name);
  EXPECT_EQ(standing.joined_at, 5);
  EXPECT_EQ(standing.joined_session, sender.session());
  EXPECT_EQ(sequences_, std::vector<std::int64_t>{5});
  EXPECT_GT(standing.told_us, network_.NowUs() - kSecondUs);
}

TEST_F(StreamRawTest, ASendersLastWordNamesItsLastMessage) {
  Listen();
  auto sender = std::make_unique<StreamHub>(network_.AddNode(), "sender");
  Send(*sender, 1);
  network_.RunFor(kSecondUs);
  network_.SetFaults({.loss = 1.0});
  Send(*sender, 2);
  network_.RunFor(1000);
  network_.SetFaults({});
  sender.reset();
  network_.RunFor(10'000);  // less than its next regular word would have taken
  const StreamStanding standing = receiver_.Standing(kExposure.name);
  EXPECT_TRUE(standing.waiting());
  EXPECT_EQ(standing.next, 2);
  EXPECT_EQ(standing.announced, 2);
}

}  // namespace
}  // namespace forgescan
