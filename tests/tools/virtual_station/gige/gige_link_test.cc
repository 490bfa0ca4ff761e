// Two cameras on one link: the paper's reason for time-division multiplexing, and its budget.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "tests/tools/virtual_station/gige/gige_channel.h"
#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan {
namespace {

// The shared port holds 64 KiB. A frame takes 2.7 ms of it; two at once need twice its rate and overrun it by
// 328 KB.
std::size_t CompleteOnSharedLink(std::int64_t offset_ns) {
  const auto link = std::make_shared<Link>(LinkOptions{1000, 64 * 1024});
  std::vector<std::unique_ptr<GigeChannel>> channels;
  for (const char* address : {"127.0.0.1", "127.0.0.2"}) {
    GigeDeviceConfig config = SmallDevice(address);
    config.link = link;
    config.image = [image = SharedRigImage(0)](std::uint64_t) {
      return image;
    };  // no rendering that could be late
    config.offers_resend = false;
    channels.push_back(Open(config, OptionsFor(config)));
  }
  // The first frame is not counted: Aravis enlarges its socket's buffer only when the first packet is there,
  // and without resends a busy machine may lose packets until then.
  for (const auto& channel : channels) {
    Fire(*channel, MonoNowNs() + kMs_ns, 0, 1);
    EXPECT_TRUE(Receive(*channel, 1));
    channel->frames.clear();
  }
  const std::int64_t start_ns = MonoNowNs() + kMs_ns;
  Fire(*channels[0], start_ns, 20 * kMs_ns, 15);
  Fire(*channels[1], start_ns + offset_ns, 20 * kMs_ns, 15);
  std::size_t complete = 0;
  for (const auto& channel : channels) {
    // Leader and trailer are small and pass, so that every frame is reported, whole or not.
    EXPECT_TRUE(Receive(*channel, 15)) << channel->frames.size();
    complete += channel->complete();
  }
  return complete;
}

TEST(GigeLink, CamerasThatTakeTurnsOnOneLinkLoseNothing) {
  EXPECT_EQ(CompleteOnSharedLink(10 * kMs_ns), 30U);
}

TEST(GigeLink, CamerasThatFireTogetherOnOneLinkLoseFrames) {
  // The paper's reason for time-division multiplexing. At most one of the two frames of a pair can get
  // through.
  EXPECT_LE(CompleteOnSharedLink(0), 15U);
}

// Image 5 of one camera is 32 ms late and would fall into the other's turn. A real camera has its image in
// time.
TEST(GigeLink, ImageThatIsLateHereTakesItsOwnTurnOnTheLink) {
  const auto link = std::make_shared<Link>(LinkOptions{1000, 64 * 1024});
  std::vector<std::unique_ptr<GigeChannel>> channels;
  for (const char* address : {"127.0.0.1", "127.0.0.2"}) {
    GigeDeviceConfig config = SmallDevice(address);
    config.link = link;
    config.offers_resend = false;  // a resend takes no turn
    config.image = [slow = channels.empty(), image = SharedRigImage(0)](std::uint64_t tag) {
      std::this_thread::sleep_for(std::chrono::milliseconds(slow && tag == 5 ? 32 : 0));
      return image;
    };
    channels.push_back(Open(config, OptionsFor(config)));
  }
  const std::int64_t start_ns = MonoNowNs() + kMs_ns;
  Fire(*channels[0], start_ns, 20 * kMs_ns, 12);
  Fire(*channels[1], start_ns + 10 * kMs_ns, 20 * kMs_ns, 12);
  for (const auto& channel : channels) {
    ASSERT_TRUE(Receive(*channel, 12));
    EXPECT_EQ(channel->device->counters().packets_refused, 0U);
  }
}

// False after kPatience_ms.
bool AllSent(const GigeDevice& device, std::uint64_t frames) {
  const std::int64_t end_ns = MonoNowNs() + kPatience_ms * kMs_ns;
  while (device.counters().frames_sent < frames && MonoNowNs() < end_ns) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return device.counters().frames_sent == frames;
}

// Two 5 MP cameras with 12 frames each on one 1 Gbit/s link, half a period apart. At the link's limit there
// is no room for resends: those that a busy machine asks for would displace other packets. So these cameras
// offer none, and what the link carried is counted, not what was read here.
GigeCounters SendOnFullLink(std::int64_t period_ns) {
  const auto link = std::make_shared<Link>(LinkOptions{});
  std::vector<std::unique_ptr<GigeChannel>> channels;
  for (const char* address : {"127.0.0.1", "127.0.0.2"}) {
    GigeDeviceConfig config = FullSizeDevice(address);
    config.link = link;
    config.offers_resend = false;
    channels.push_back(Open(config, OptionsFor(config)));
  }
  const std::int64_t start_ns = MonoNowNs() + kMs_ns;
  Fire(*channels[0], start_ns, period_ns, 12);
  Fire(*channels[1], start_ns + period_ns / 2, period_ns, 12);
  GigeCounters total;
  for (const auto& channel : channels) {
    EXPECT_TRUE(AllSent(*channel->device, 12));
    const GigeCounters counters = channel->device->counters();
    total.frames_overrun += counters.frames_overrun;
    total.packets_sent += counters.packets_sent;
    total.packets_refused += counters.packets_refused;
  }
  return total;
}

TEST(GigeLink, TwelvePatternsInASecondFromTwoFullSizeCamerasFitOneLink) {
  // The paper's budget. A frame takes 40.6 ms of the link.
  const GigeCounters total = SendOnFullLink(82 * kMs_ns);
  EXPECT_EQ(total.frames_overrun, 0U);
  EXPECT_EQ(total.packets_refused, 0U);
  EXPECT_GE(total.packets_sent, 24U * (2448 * 2048 / 9000));
}

TEST(GigeLink, FourteenPatternsInASecondDoNot) {
  const GigeCounters total = SendOnFullLink(71 * kMs_ns);
  EXPECT_EQ(total.frames_overrun, 0U);  // each camera keeps up with its own port
  EXPECT_GT(total.packets_refused, 0U);
}

}  // namespace
}  // namespace forgescan
