// What a service says of itself comes once a second, and at once when it has given a message up.
#include "services/common/service/service_monitor.h"

#include <gtest/gtest.h>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"

namespace forgescan {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;

TEST(ServiceMonitor, TellsALossAtOnceAndNotAgainAndAgain) {
  SimNetwork network;
  StreamHub receiver(network.AddNode(), "receiver");
  ServiceMonitor monitor(receiver, "receiver", "");
  std::vector<fsmsg::service_state_t> states;
  SubscribeState<fsmsg::service_state_t>(network.AddNode(), kServiceState,
                                         [&](const auto& state) { states.push_back(state); });
  std::int64_t lost_us = 0;
  receiver.Subscribe<fsmsg::verdict_t>(kVerdict, [](const auto&) {});
  receiver.OnLost(kVerdict, [&](std::int64_t, std::int64_t) { lost_us = network.NowUs(); });
  StreamHub sender(network.AddNode(), "sender", {.history_bytes = 1, .burst_bytes = 1});  // keeps one message
  sender.Advertise(kVerdict);
  network.RunFor(kSecondUs + kSecondUs / 10);
  states.clear();
  network.SetFaults({.loss = 1.0});
  ASSERT_TRUE(sender.Publish(kVerdict, fsmsg::verdict_t{}).ok());
  network.RunFor(1000);
  network.SetFaults({});
  ASSERT_TRUE(sender.Publish(kVerdict, fsmsg::verdict_t{}).ok());
  ASSERT_TRUE(network.RunUntilTrue([&] { return !states.empty(); }, kSecondUs));
  ASSERT_GT(lost_us, 0);
  EXPECT_EQ(states[0].messages_missing, 1);
  EXPECT_LE(network.NowUs() - lost_us, 20'000);
  network.RunFor(3 * kSecondUs);
  EXPECT_EQ(states.size(), 4u) << "and once a second";
}

}  // namespace
}  // namespace forgescan
