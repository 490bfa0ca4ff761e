// A sender that starts anew, also after the wall clock was set back, is heard from its first message on, and
// what is left of its last life on the network changes nothing.
#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kHourUs = 3600 * kSecondUs;

// The bus of a process that was started after the wall clock stepped.
class SteppedBus final : public Bus {
 public:
  SteppedBus(SimBus& bus, std::int64_t step_us) : bus_(bus), step_us_(step_us) {}
  std::int64_t NowUs() const override { return bus_.NowUs() + step_us_; }
  Status Publish(std::string_view channel, ByteView message) override {
    return bus_.Publish(channel, message);
  }
  SubscriptionId Subscribe(const std::string& channel, MessageHandler handler) override {
    return bus_.Subscribe(channel, std::move(handler));
  }
  void Unsubscribe(SubscriptionId subscription) override { bus_.Unsubscribe(subscription); }
  TimerId At(std::int64_t utime, TimerHandler handler) override {
    return bus_.At(utime - step_us_, std::move(handler));
  }
  TimerId Every(std::int64_t period_us, TimerHandler handler) override {
    return bus_.Every(period_us, std::move(handler));
  }
  void Cancel(TimerId timer) override { bus_.Cancel(timer); }
  BusHealth Health() const override { return bus_.Health(); }

 private:
  SimBus& bus_;
  std::int64_t step_us_;
};

class StreamSessionTest : public ::testing::Test {
 protected:
  // One life of a sender, on the clock as it was set when it started.
  class Sender {
   public:
    Sender(SimNetwork& network, std::int64_t step_us)
        : network_(network), node_(network.AddNode()), bus_(node_, step_us) {}
    ~Sender() {
      hub_.reset();
      network_.RemoveNode(node_);
    }
    StreamHub& hub() { return *hub_; }

   private:
    SimNetwork& network_;
    SimBus& node_;
    SteppedBus bus_;
    std::unique_ptr<StreamHub> hub_ = std::make_unique<StreamHub>(bus_, "sender");
  };

  StreamSessionTest() {
    receiver_.Subscribe<fsmsg::verdict_t>(kVerdict,
                                          [this](const auto& verdict) { parts_.push_back(verdict.part); });
    receiver_.OnLost(kVerdict, [this](std::int64_t first, std::int64_t last) { lost_ += last - first + 1; });
    for (const char* channel : {kVerdict.name, "STREAM_STATUS", "RESEND_PIECE"}) {
      recorder_.Subscribe(channel, [this, channel](ByteView bytes) {
        recorded_.emplace_back(channel, Bytes(bytes.begin(), bytes.end()));
      });
    }
    network_.RunFor(kSecondUs);
  }
  void Send(Sender& sender, int count) {
    fsmsg::verdict_t verdict{};
    for (int i = 0; i < count; ++i) {
      verdict.part = ++sent_;
      ASSERT_TRUE(sender.hub().Publish(kVerdict, verdict).ok());
    }
  }
  void Replay(const std::vector<std::pair<std::string, Bytes>>& datagrams) {
    for (const auto& [channel, bytes] : datagrams) {
      ASSERT_TRUE(recorder_.Publish(channel, bytes).ok());
    }
    network_.RunFor(kSecondUs);
  }
  void ExpectAllSent() const {
    ASSERT_EQ(parts_.size(), static_cast<std::size_t>(sent_));
    for (int i = 0; i < sent_; ++i) {
      EXPECT_EQ(parts_[static_cast<std::size_t>(i)], i + 1);
    }
    EXPECT_EQ(lost_, 0);
  }

  SimNetwork network_{5};
  StreamHub receiver_{network_.AddNode(), "receiver"};
  SimBus& recorder_ = network_.AddNode();
  std::vector<std::pair<std::string, Bytes>> recorded_;  // channel, datagram
  std::vector<int> parts_;
  int sent_ = 0;
  std::int64_t lost_ = 0;
};

TEST_F(StreamSessionTest, AClockSetBackBetweenTwoLivesOfASenderLosesNothing) {
  {
    Sender first(network_, 0);
    Send(first, 3);
    network_.RunFor(kSecondUs);
  }
  Sender second(network_, -kHourUs);
  network_.SetFaults({.loss = 0.5});
  Send(second, 20);
  network_.RunFor(20 * kSecondUs);
  ExpectAllSent();
}

TEST_F(StreamSessionTest, ALateDatagramOfTheLastLifeChangesNothing) {
  for (const std::int64_t step_us : {-kHourUs, kHourUs}) {
    recorded_.clear();
    std::vector<std::pair<std::string, Bytes>> old;
    {
      Sender first(network_, 0);
      Send(first, 3);
      network_.RunFor(kSecondUs);
      old = recorded_;
    }
    Sender second(network_, step_us);
    Send(second, 1);
    network_.RunFor(kSecondUs);
    Replay(old);
    ExpectAllSent();
    network_.SetFaults({.loss = 0.5});
    Send(second, 5);
    network_.RunFor(20 * kSecondUs);
    network_.SetFaults({});
    ExpectAllSent();
    Replay(old);
    ExpectAllSent();
  }
}

TEST_F(StreamSessionTest, ManyLivesWithAClockThatJumps) {
  for (int life = 0; life < 30; ++life) {
    Sender sender(network_, (life % 3 - 1) * life * kHourUs);
    Send(sender, 2);
    network_.RunFor(kSecondUs);
  }
  ExpectAllSent();
}

TEST_F(StreamSessionTest, WhatTheLastLifeStillOwedIsCountedOnce) {
  {
    Sender first(network_, 0);
    Send(first, 1);
    network_.RunFor(kSecondUs);
    network_.SetFaults({.loss = 1.0});
    Send(first, 1);
    network_.RunFor(100);
    network_.SetFaults({});
    Send(first, 1);
    network_.RunFor(1000);
  }
  Sender second(network_, -kHourUs);
  Send(second, 1);
  network_.RunFor(20 * kSecondUs);
  EXPECT_EQ(lost_, 1);
  EXPECT_EQ(parts_, (std::vector<int>{1, 3, 4}));
}

}  // namespace
}  // namespace forgescan
