// The resend protocol on a bus that loses, doubles and reorders: every message once, whole, in order, or
// counted as missing.
#include <gtest/gtest.h>

#include <numeric>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_header.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

constexpr std::int64_t kMinuteUs = 60'000'000;

fsmsg::frame_t Frame(int number, std::size_t bytes) {
  fsmsg::frame_t frame{};
  frame.frame_id = number;
  frame.data.assign(bytes, static_cast<std::uint8_t>(number));
  frame.size = static_cast<std::int32_t>(bytes);
  return frame;
}

struct Received {
  std::vector<std::int64_t> ids;
  bool whole = true;
  std::int64_t lost = 0;

  void Listen(StreamHub& hub) {
    hub.Subscribe<fsmsg::frame_t>(kFrameLeft, [this](const fsmsg::frame_t& frame) {
      ids.push_back(frame.frame_id);
      for (const auto byte : frame.data) {
        whole = whole && byte == static_cast<std::uint8_t>(frame.frame_id);
      }
    });
    hub.OnLost(kFrameLeft, [this](std::int64_t first, std::int64_t last) { lost += last - first + 1; });
  }
};

std::vector<std::int64_t> OneTo(int count) {
  std::vector<std::int64_t> ids(static_cast<std::size_t>(count));
  std::iota(ids.begin(), ids.end(), 1);
  return ids;
}

void PublishAll(SimNetwork& network, StreamHub& sender, int count, std::size_t bytes) {
  for (int i = 1; i <= count; ++i) {
    ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(i, bytes)).ok());
    network.RunFor(45'000);
  }
}

struct Case {
  const char* name;
  SimFaults faults;
};

class StreamUnderFaults : public ::testing::TestWithParam<Case> {};

TEST_P(StreamUnderFaults, EveryMessageOnceWholeAndInOrder) {
  constexpr int kMessages = 60;
  SimNetwork network(7);
  network.SetFaults(GetParam().faults);
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  network.RunFor(1000);
  StreamHub sender(network.AddNode(), "sender");
  sender.Advertise(kFrameLeft);
  PublishAll(network, sender, kMessages, 150'000);
  network.RunUntilTrue([&] { return received.ids.size() >= kMessages; }, kMinuteUs);
  EXPECT_EQ(received.ids, OneTo(kMessages));
  EXPECT_TRUE(received.whole);
  EXPECT_EQ(received.lost, 0);
  EXPECT_EQ(receiver.counters().missing, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Faults, StreamUnderFaults,
    ::testing::Values(Case{"None", {}}, Case{"Loss", {.loss = 0.2, .large_loss = 0.2}},
                      Case{"LargeAlwaysLost", {.loss = 0.05, .large_loss = 1.0}},
                      Case{"Duplicates", {.duplicate = 0.5}}, Case{"Reordered", {.jitter_us = 300'000}},
                      Case{"Everything",
                           {.loss = 0.2, .large_loss = 0.6, .duplicate = 0.3, .jitter_us = 100'000}}),
    [](const auto& param) { return param.param.name; });

TEST(Stream, LossAtTheEndIsNoticed) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  StreamHub sender(network.AddNode(), "sender");
  network.RunFor(100'000);
  network.SetFaults({.large_loss = 1.0});
  ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(1, 100'000)).ok());
  EXPECT_TRUE(network.RunUntilTrue([&] { return received.ids == OneTo(1); }, kMinuteUs));
  EXPECT_EQ(receiver.counters().recovered, 1);
}

TEST(Stream, GivesUpInBoundedTimeSaysSoAndGoesOn) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  SimBus& doomed = network.AddNode();
  auto sender = std::make_unique<StreamHub>(doomed, "sender");
  ASSERT_TRUE(sender->Publish(kFrameLeft, Frame(1, 10)).ok());
  network.RunFor(100'000);
  network.SetFaults({.loss = 1.0});
  ASSERT_TRUE(sender->Publish(kFrameLeft, Frame(2, 10)).ok());
  network.RunFor(1000);
  network.SetFaults({});
  ASSERT_TRUE(sender->Publish(kFrameLeft, Frame(3, 10)).ok());
  network.RunFor(1000);
  sender.reset();  // nobody left to ask
  network.RemoveNode(doomed);
  EXPECT_TRUE(network.RunUntilTrue([&] { return received.lost == 1; }, 11'000'000));
  EXPECT_EQ(received.ids, (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(receiver.counters().missing, 1);
}

TEST(Stream, ABacklogLongerThanTheGiveUpTimeIsCarriedToTheEnd) {
  constexpr int kMessages = 40;
  SimNetwork network(3);
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  // 40 messages of 20 pieces, 50 ms a piece: 40 s of resends, four times the give-up time.
  StreamHub sender(network.AddNode(), "sender", {.piece_bytes = 5'000, .piece_gap_us = 50'000});
  network.SetFaults({.large_loss = 1.0});
  for (int i = 1; i <= kMessages; ++i) {
    ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(i, 100'000)).ok());
  }
  EXPECT_TRUE(network.RunUntilTrue([&] { return received.ids.size() == kMessages; }, 2 * kMinuteUs));
  EXPECT_EQ(received.lost, 0);
}

TEST(Stream, WhatTheSenderNoLongerKeepsIsGivenUpAtOnce) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  StreamHub sender(network.AddNode(), "sender", {.history_bytes = 1000, .burst_bytes = 1000});
  sender.Advertise(kFrameLeft);
  network.RunFor(1'000'000);
  network.SetFaults({.loss = 1.0});
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(i, 800)).ok());
  }
  network.RunFor(1000);
  network.SetFaults({});
  EXPECT_TRUE(network.RunUntilTrue([&] { return received.ids.size() == 1; }, 2'000'000));
  EXPECT_EQ(received.ids, (std::vector<std::int64_t>{5}));
  EXPECT_EQ(received.lost, 4);
}

TEST(Stream, ABurstLargerThanTheHistoryIsKeptUntilNobodyAsksAnyMore) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  StreamHub sender(network.AddNode(), "sender", {.history_bytes = 1000, .burst_bytes = 10'000});
  sender.Advertise(kFrameLeft);
  network.RunFor(1'000'000);
  network.SetFaults({.loss = 1.0});
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(i, 800)).ok());
  }
  network.RunFor(1000);
  network.SetFaults({});
  EXPECT_TRUE(network.RunUntilTrue([&] { return received.ids.size() == 5; }, 5'000'000));
  EXPECT_EQ(received.lost, 0);
}

TEST(Stream, ALateReceiverStartsWithTheNextMessage) {
  SimNetwork network;
  StreamHub sender(network.AddNode(), "sender");
  ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(1, 10)).ok());
  network.RunFor(1'000'000);
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  network.RunFor(1'000'000);
  ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(2, 10)).ok());
  network.RunFor(1'000'000);
  EXPECT_EQ(received.ids, (std::vector<std::int64_t>{2}));
  EXPECT_EQ(received.lost, 0);
}

TEST(Stream, ARestartedSenderIsHeardFromItsFirstMessage) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  for (int run = 1; run <= 2; ++run) {
    SimBus& node = network.AddNode();
    StreamHub sender(node, "sender");
    network.RunFor(10'000);
    ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(run, 10)).ok());
    network.RunFor(1'000'000);
  }
  EXPECT_EQ(received.ids, OneTo(2));
  EXPECT_EQ(received.lost, 0);
}

TEST(Stream, ADamagedMessageIsCountedAndAskedForAgain) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  SimBus& vandal = network.AddNode();
  StreamHub sender(network.AddNode(), "sender");
  network.RunFor(100'000);
  Bytes message = Encode(Frame(1, 10));
  ASSERT_TRUE(StampStreamHeader(message, {sender.session(), 1}).ok());
  message.back() ^= 1;
  ASSERT_TRUE(vandal.Publish(kFrameLeft.name, message).ok());
  network.RunFor(1000);
  EXPECT_EQ(receiver.counters().damaged, 1);
  ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(1, 10)).ok());
  network.RunFor(1'000'000);
  EXPECT_EQ(received.ids, OneTo(1));
}

TEST(Stream, NonsenseOnTheProtocolChannelsDoesNoHarm) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  Received received;
  received.Listen(receiver);
  StreamHub sender(network.AddNode(), "sender");
  SimBus& vandal = network.AddNode();
  for (const char* channel : {"STREAM_STATUS", "RESEND_REQUEST", "RESEND_PIECE", "FRAME_LEFT"}) {
    for (const std::size_t size : {0u, 7u, 40u, 4000u}) {
      ASSERT_TRUE(vandal.Publish(channel, Bytes(size, 0xff)).ok());
    }
  }
  network.RunFor(100'000);
  ASSERT_TRUE(sender.Publish(kFrameLeft, Frame(1, 10)).ok());
  network.RunFor(1'000'000);
  EXPECT_EQ(received.ids, OneTo(1));
}

TEST(Stream, RefusesAMessageThatIsTooLarge) {
  SimNetwork network;
  StreamHub sender(network.AddNode(), "sender");
  EXPECT_FALSE(sender.Publish(kFrameLeft, Frame(1, kMaxMessageBytes)).ok());
}

}  // namespace
}  // namespace forgescan
