// What every CAN backend keeps: run over the in-process wire, over UDP multicast and, where the kernel has
// it, SocketCAN.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <string>

#include "drivers/can/can_inprocess.h"
#include "drivers/can/open_can_bus.h"

namespace forgescan {
namespace {

constexpr std::int64_t kBenchTime_us = 1'000'000;

CanFrame Frame(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
  CanFrame frame{.id = id, .length = static_cast<std::uint8_t>(data.size())};
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

// Two stations of one bus; Settle returns when what was sent has arrived.
class CanBench {
 public:
  explicit CanBench(const std::string& kind) {
    if (kind == "inprocess") {
      a_ = wire_.Attach();
      b_ = wire_.Attach();
      return;
    }
    for (auto* bus : {&a_, &b_}) {
      auto opened = OpenCanBus(kind, [] { return kBenchTime_us; });
      if (!opened.ok()) {
        why_not_ = opened.error().message;
        return;
      }
      *bus = std::move(*opened);
    }
  }

  const std::string& why_not() const { return why_not_; }
  CanBus& a() { return *a_; }
  CanBus& b() { return *b_; }

  void Settle() {
    wire_.StepTo(wire_.now_us() + 10'000);
    pollfd waiting[] = {{a_->fd(), POLLIN, 0}, {b_->fd(), POLLIN, 0}};
    do {  // loopback delivers within the send call; 20 ms of silence is the end
      EXPECT_TRUE(a_->Drain().ok());
      EXPECT_TRUE(b_->Drain().ok());
    } while (a_->fd() >= 0 && ::poll(waiting, 2, 20) > 0);
  }

 private:
  InProcessCan wire_{{}, kBenchTime_us};
  std::unique_ptr<CanBus> a_, b_;
  std::string why_not_;
};

class CanBusContract : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!bench_.why_not().empty()) {
      GTEST_SKIP() << bench_.why_not();
    }
    bench_.a().AddHandler([this](const CanFrame& frame) { heard_by_a_.push_back(frame); });
    bench_.b().AddHandler([this](const CanFrame& frame) { heard_by_b_.push_back(frame); });
  }

  CanBench bench_{GetParam()};
  std::vector<CanFrame> heard_by_a_, heard_by_b_;
};

TEST_P(CanBusContract, Starts) {
  bench_.Settle();
  EXPECT_TRUE(heard_by_a_.empty());
}

TEST_P(CanBusContract, CarriesEveryKindOfFrameUnchangedAndInOrder) {
  std::vector<CanFrame> sent = {Frame(0x190, {1, 2, 3, 4, 5, 6, 7, 8}), Frame(0x7FF, {}), Frame(0, {255})};
  sent.push_back({.id = 0x1FFFFFFF, .extended = true, .length = 1, .data = {7}});
  sent.push_back({.id = 0x123, .rtr = true, .length = 4});
  for (const CanFrame& frame : sent) {
    ASSERT_TRUE(bench_.a().Send(frame).ok());
  }
  bench_.Settle();
  ASSERT_EQ(heard_by_b_.size(), sent.size());
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_TRUE(SameOnWire(heard_by_b_[i], sent[i])) << i;
    EXPECT_GE(heard_by_b_[i].utime, kBenchTime_us);
  }
  EXPECT_EQ(bench_.a().counters().sent, sent.size());
  EXPECT_EQ(bench_.b().counters().received, sent.size());
}

TEST_P(CanBusContract, DoesNotHearItself) {
  ASSERT_TRUE(bench_.a().Send(Frame(0x190, {1})).ok());
  bench_.Settle();
  EXPECT_TRUE(heard_by_a_.empty());
  EXPECT_EQ(heard_by_b_.size(), 1U);
}

TEST_P(CanBusContract, FiltersByIdentifierAndKind) {
  ASSERT_TRUE(bench_.b().SetFilters({{.id = 0x180, .mask = 0x780}}).ok());
  ASSERT_TRUE(bench_.a().Send(Frame(0x190, {1})).ok());
  ASSERT_TRUE(bench_.a().Send(Frame(0x290, {2})).ok());
  ASSERT_TRUE(bench_.a().Send({.id = 0x190, .extended = true}).ok());
  bench_.Settle();
  ASSERT_EQ(heard_by_b_.size(), 1U);
  EXPECT_EQ(heard_by_b_[0].id, 0x190U);
}

TEST_P(CanBusContract, RefusesWhatIsNoFrameAndStillWorks) {
  EXPECT_EQ(bench_.a().Send({.id = 0x800}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bench_.a().Send({.id = 0x20000000, .extended = true}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bench_.a().Send({.id = 1, .length = 9}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bench_.a().Send({.id = 1, .error = true}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bench_.a().counters().send_failures, 4U);
  ASSERT_TRUE(bench_.a().Send(Frame(1, {1})).ok());
  bench_.Settle();
  EXPECT_EQ(heard_by_b_.size(), 1U);
}

TEST_P(CanBusContract, AHandlerMaySend) {
  bench_.b().AddHandler([this](const CanFrame& frame) {
    if (frame.id == 0x210) {
      EXPECT_TRUE(bench_.b().Send(Frame(0x190, {9})).ok());
    }
  });
  ASSERT_TRUE(bench_.a().Send(Frame(0x210, {1})).ok());
  bench_.Settle();
  bench_.Settle();
  ASSERT_EQ(heard_by_a_.size(), 1U);
  EXPECT_EQ(heard_by_a_[0].id, 0x190U);
}

std::string NameOf(const testing::TestParamInfo<const char*>& param) {
  const std::string url = param.param;
  return url.substr(0, url.find(':'));
}

INSTANTIATE_TEST_SUITE_P(Buses, CanBusContract,
                         testing::Values("inprocess", "udp:239.74.163.2:43113", "socketcan:vcan0"), NameOf);

TEST(OpenCanBus, SaysWhatIsWrongWithAUrl) {
  for (const char* url :
       {"", "can0", "socketcan:", "udp:", "udp:1.2.3.4:5", "udp:239.74.163.2", "udp:239.74.163.2:0",
        "udp:239.74.163.2:70000", "udp:239.74.163.2:1?ttl=1", "udp:239.74.163.2:1?hops=99"}) {
    const auto bus = OpenCanBus(url, [] { return std::int64_t{0}; });
    ASSERT_FALSE(bus.ok()) << url;
    EXPECT_EQ(bus.error().code, ErrorCode::kInvalidArgument) << url;
  }
}

TEST(OpenCanBus, NamesAnInterfaceThatIsNotThere) {
  const auto bus = OpenCanBus("socketcan:none9", [] { return std::int64_t{0}; });
  ASSERT_FALSE(bus.ok());
  EXPECT_EQ(bus.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(bus.error().message, testing::HasSubstr("none9"));
}

}  // namespace
}  // namespace forgescan
