// One suite for every Bus: what a service may rely on, in process and between processes.
#include <gtest/gtest.h>

#include <memory>

#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/sim_bus.h"

namespace forgescan {
namespace {

constexpr std::int64_t kPatienceUs = 5'000'000;  // an answer that takes longer on loopback is no answer

// Two nodes on one bus, and a way to let time pass.
class Pair {
 public:
  virtual ~Pair() = default;
  virtual Bus& a() = 0;
  virtual Bus& b() = 0;
  virtual bool RunUntilTrue(const std::function<bool()>& condition, std::int64_t duration_us) = 0;
};

class SimPair final : public Pair {
 public:
  Bus& a() override { return a_; }
  Bus& b() override { return b_; }
  bool RunUntilTrue(const std::function<bool()>& condition, std::int64_t duration_us) override {
    return network_.RunUntilTrue(condition, duration_us);
  }

 private:
  SimNetwork network_;
  SimBus& a_ = network_.AddNode();
  SimBus& b_ = network_.AddNode();
};

class LcmPair final : public Pair {
 public:
  LcmPair() : a_(OpenOrDie()), b_(OpenOrDie()) {}
  Bus& a() override { return *a_; }
  Bus& b() override { return *b_; }
  bool RunUntilTrue(const std::function<bool()>& condition, std::int64_t duration_us) override {
    const std::int64_t until_us = a_->NowUs() + duration_us;
    while (!condition() && a_->NowUs() < until_us) {
      EXPECT_TRUE(a_->RunOnce(1000).ok());
      EXPECT_TRUE(b_->RunOnce(1000).ok());
    }
    return condition();
  }

 private:
  static std::unique_ptr<LcmBus> OpenOrDie() {
    auto bus = LcmBus::Open("udpm://239.255.76.67:7667?ttl=0&recv_buf_size=16000000");
    if (!bus.ok()) {
      throw std::runtime_error(bus.error().message);
    }
    return std::move(bus).value();
  }
  std::unique_ptr<LcmBus> a_, b_;
};

enum class Kind { kSim, kLcm };

class BusContract : public ::testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    pair_ = GetParam() == Kind::kSim ? std::unique_ptr<Pair>(std::make_unique<SimPair>())
                                     : std::make_unique<LcmPair>();
  }
  std::unique_ptr<Pair> pair_;
};

TEST_P(BusContract, Starts) { EXPECT_GT(pair_->a().NowUs(), 1'600'000'000'000'000); }

TEST_P(BusContract, WhoHasUnsubscribedHearsNothingMore) {
  int gone = 0, stays = 0;
  const auto subscription = pair_->b().Subscribe("X", [&](ByteView) { ++gone; });
  pair_->b().Subscribe("X", [&](ByteView) { ++stays; });
  ASSERT_TRUE(pair_->a().Publish("X", Bytes{1}).ok());
  ASSERT_TRUE(pair_->RunUntilTrue([&] { return stays == 1; }, kPatienceUs));
  ASSERT_TRUE(pair_->a().Publish("X", Bytes{2}).ok());  // under way when it is unsubscribed
  pair_->b().Unsubscribe(subscription);
  pair_->b().Unsubscribe(subscription);  // again: nothing
  ASSERT_TRUE(pair_->a().Publish("X", Bytes{3}).ok());
  ASSERT_TRUE(pair_->RunUntilTrue([&] { return stays == 3; }, kPatienceUs));
  EXPECT_EQ(gone, 1);
}

TEST_P(BusContract, DeliversToEverySubscriberItselfIncluded) {
  Bytes at_a, at_b;
  pair_->a().Subscribe("X", [&](ByteView bytes) { at_a.assign(bytes.begin(), bytes.end()); });
  pair_->b().Subscribe("X", [&](ByteView bytes) { at_b.assign(bytes.begin(), bytes.end()); });
  const Bytes sent{1, 2, 3};
  ASSERT_TRUE(pair_->a().Publish("X", sent).ok());
  EXPECT_TRUE(pair_->RunUntilTrue([&] { return at_a == sent && at_b == sent; }, kPatienceUs));
}

TEST_P(BusContract, ChannelsAreExactNames) {
  int exact = 0, other = 0;
  pair_->b().Subscribe("FRAME", [&](ByteView) { ++exact; });
  pair_->b().Subscribe("F.AME", [&](ByteView) { ++other; });
  ASSERT_TRUE(pair_->a().Publish("FRAME_LEFT", Bytes{1}).ok());
  ASSERT_TRUE(pair_->a().Publish("FRAME", Bytes{1}).ok());
  EXPECT_TRUE(pair_->RunUntilTrue([&] { return exact == 1; }, kPatienceUs));
  EXPECT_FALSE(pair_->RunUntilTrue([&] { return exact > 1 || other > 0; }, 20'000));
}

TEST_P(BusContract, CarriesAMessageOfOneCameraFrame) {
  std::size_t received = 0;
  pair_->b().Subscribe("X", [&](ByteView bytes) { received = bytes.size(); });
  const Bytes frame(5'013'600, 7);
  bool arrived = false;
  for (int attempt = 0; attempt < 5 && !arrived; ++attempt) {  // a busy host may drop one
    ASSERT_TRUE(pair_->a().Publish("X", frame).ok());
    arrived = pair_->RunUntilTrue([&] { return received == frame.size(); }, kPatienceUs / 5);
  }
  EXPECT_TRUE(arrived);
}

TEST_P(BusContract, RefusesWhatMustNotBeSent) {
  EXPECT_FALSE(pair_->a().Publish("X", Bytes(kMaxMessageBytes + 1)).ok());
  EXPECT_FALSE(pair_->a().Publish("", Bytes{1}).ok());
  EXPECT_FALSE(pair_->a().Publish(std::string(64, 'X'), Bytes{1}).ok());
}

TEST_P(BusContract, TimersRunInOrderAndNotEarly) {
  Bus& bus = pair_->a();
  const std::int64_t start_us = bus.NowUs();
  std::string order;
  bus.At(start_us + 20'000, [&] { order += bus.NowUs() >= start_us + 20'000 ? "c" : "early"; });
  bus.At(start_us + 10'000, [&] { order += "a"; });
  bus.At(start_us + 10'000, [&] { order += "b"; });
  bus.Cancel(bus.At(start_us + 5'000, [&] { order += "cancelled"; }));
  EXPECT_TRUE(pair_->RunUntilTrue([&] { return order.size() >= 3; }, kPatienceUs));
  EXPECT_EQ(order, "abc");
}

TEST_P(BusContract, PeriodicTimerRepeatsUntilCancelledByItself) {
  Bus& bus = pair_->a();
  int runs = 0;
  Bus::TimerId timer = 0;
  timer = bus.Every(2'000, [&] {
    if (++runs == 3) {
      bus.Cancel(timer);
    }
  });
  EXPECT_TRUE(pair_->RunUntilTrue([&] { return runs == 3; }, kPatienceUs));
  EXPECT_FALSE(pair_->RunUntilTrue([&] { return runs > 3; }, 20'000));
}

TEST_P(BusContract, AHandlerMaySubscribeAndPublish) {
  bool answered = false;
  pair_->b().Subscribe("ASK", [&](ByteView) { ASSERT_TRUE(pair_->b().Publish("ANSWER", Bytes{1}).ok()); });
  pair_->a().Subscribe("ANSWER", [&](ByteView) { answered = true; });
  ASSERT_TRUE(pair_->a().Publish("ASK", Bytes{1}).ok());
  EXPECT_TRUE(pair_->RunUntilTrue([&] { return answered; }, kPatienceUs));
}

TEST(SimBus, ForgetsTimersThatHaveRun) {
  SimNetwork network;
  SimBus& bus = network.AddNode();
  int runs = 0;
  for (int i = 0; i < 3; ++i) {
    bus.At(bus.NowUs() + 10 * i, [&runs] { ++runs; });
  }
  const auto repeated = bus.Every(1000, [] {});
  bus.Cancel(bus.At(bus.NowUs() + 50, [&runs] { ++runs; }));
  EXPECT_EQ(bus.timer_count(), 4u);
  network.RunFor(2500);
  EXPECT_EQ(runs, 3);
  EXPECT_EQ(bus.timer_count(), 1u);
  bus.Cancel(repeated);
  EXPECT_EQ(bus.timer_count(), 0u);
}

TEST(SimBus, WhatItsFilterRefusesReachesNobody) {
  SimNetwork network;
  SimBus &sender = network.AddNode(), &receiver = network.AddNode();
  std::vector<Bytes> heard;
  receiver.Subscribe("X", [&heard](ByteView message) { heard.emplace_back(message.begin(), message.end()); });
  sender.SetSendFilter([](std::string_view, ByteView message) { return message[0] != 2; });
  for (const Bytes& message : {Bytes{1}, Bytes{2}, Bytes{3}}) {
    ASSERT_TRUE(sender.Publish("X", message).ok());
  }
  network.RunFor(10'000);
  EXPECT_EQ(heard, (std::vector<Bytes>{{1}, {3}}));
}

INSTANTIATE_TEST_SUITE_P(Buses, BusContract, ::testing::Values(Kind::kSim, Kind::kLcm),
                         [](const auto& param) { return param.param == Kind::kSim ? "SimBus" : "LcmBus"; });

TEST(LcmBus, TellsWhatTheKernelGaveIt) {
  auto bus = LcmBus::Open("udpm://239.255.76.67:7668?ttl=0&recv_buf_size=50000");
  ASSERT_TRUE(bus.ok()) << bus.error().message;
  EXPECT_EQ((*bus)->Health().receive_buffer_bytes, 100'000);  // the kernel doubles what it is asked for
}

TEST(LcmBus, RefusesAUrlThatIsNotABus) {
  for (const char* url :
       {"", "memq://", "udpm://239.255.76.67", "udpm://239.255.76.67:99999", "file://x.log"}) {
    EXPECT_FALSE(LcmBus::Open(url).ok()) << url;
  }
}

}  // namespace
}  // namespace forgescan
