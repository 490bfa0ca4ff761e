// The production camera driver against the virtual camera over the loopback interface: losses, repair.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera/camera_aravis.h"
#include "tests/drivers/camera/camera_rig.h"
#include "tests/tools/virtual_station/gige/gige_channel.h"
#include "tools/virtual_station/gige/gige_device.h"
#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan {
namespace {

TEST(GigeLine, OnePercentOfPacketsLostIsRepaired) {
  const GigeDeviceConfig config = SmallDevice("127.0.0.1");
  CameraAravisOptions options = OptionsFor(config);
  options.packet_size_bytes = 1500;  // 226 packets a frame
  const auto channel = Open(config, options);
  GigeFaults faults;
  faults.packet_loss_chance = 0.01;
  channel->device->SetFaults(faults);
  Fire(*channel, MonoNowNs() + kMs_ns, 20 * kMs_ns, 40);
  ASSERT_TRUE(Receive(*channel, 40));
  EXPECT_EQ(channel->complete(), 40U);
  const GigeCounters counters = channel->device->counters();
  EXPECT_GE(counters.packets_lost, 50U);  // of 9000: 90 expected, 9.5 standard deviation
  EXPECT_GT(counters.resends, 0U);
  EXPECT_GT(channel->camera->counters().packets_resent, 0U);
}

TEST(GigeLine, LostLeaderWithoutRepairGivesAnIncompleteFrameOfUnknownTime) {
  const GigeDeviceConfig config = SmallDevice("127.0.0.1");
  const auto channel = Open(config, OptionsFor(config));
  GigeFaults faults;
  faults.resend_unavailable = true;
  faults.packet_loss_chance = 0.5;
  channel->device->SetFaults(faults);
  Fire(*channel, MonoNowNs() + kMs_ns, 20 * kMs_ns, 12);
  ASSERT_TRUE(Receive(*channel, 12));
  EXPECT_EQ(channel->complete(), 0U);
  std::size_t unknown = 0;
  for (const CameraFrame& frame : channel->frames) {
    EXPECT_EQ(frame.frame_id == 0, frame.device_time_us == 0);
    EXPECT_TRUE(frame.pixels.empty());
    unknown += frame.frame_id == 0 ? 1U : 0U;
  }
  EXPECT_GT(unknown, 0U);  // half of the leaders are lost
  EXPECT_LT(unknown, 12U);
  EXPECT_GT(channel->device->counters().resends_unavailable, 0U);
}

TEST(GigeLine, TwoCamerasInOneProcessKeepTheirImagesApart) {
  GigeDeviceConfig right_config = SmallDevice("127.0.0.2");
  right_config.image = [](std::uint64_t tag) { return SharedRigImage(tag + 100); };
  const auto left = Open(SmallDevice("127.0.0.1"), OptionsFor(SmallDevice("127.0.0.1")));
  const auto right = Open(right_config, OptionsFor(right_config));
  const std::int64_t start_ns = MonoNowNs() + kMs_ns;
  Fire(*left, start_ns, 10 * kMs_ns, 10);
  Fire(*right, start_ns, 10 * kMs_ns, 10);
  ASSERT_TRUE(Receive(*left, 10));
  ASSERT_TRUE(Receive(*right, 10));
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_TRUE(left->frames[i].pixels == RigImage(i)) << i;
    EXPECT_TRUE(right->frames[i].pixels == RigImage(i + 100)) << i;
    EXPECT_EQ(left->frames[i].device_time_us, right->frames[i].device_time_us);
  }
}

TEST(GigeLine, FullSizeFramesArrive) {
  GigeDeviceConfig config = FullSizeDevice("127.0.0.1");
  config.rate_mbit_s = 2500;  // 16 ms a frame
  const auto channel = Open(config, OptionsFor(config));
  Fire(*channel, MonoNowNs() + kMs_ns, 40 * kMs_ns, 6);
  ASSERT_TRUE(Receive(*channel, 6));
  const auto image = config.image(0);
  for (const CameraFrame& frame : channel->frames) {
    EXPECT_TRUE(frame.complete);
    EXPECT_TRUE(frame.pixels == *image);
  }
}

TEST(GigeLine, RegionSmallerThanTheSensorIsItsUpperLeftPart) {
  const GigeDeviceConfig config = SmallDevice("127.0.0.1");
  CameraAravisOptions options = OptionsFor(config);
  options.width_px = 320;
  options.height_px = 64;
  const auto channel = Open(config, options);
  Fire(*channel, MonoNowNs() + kMs_ns, 10 * kMs_ns, 1);
  ASSERT_TRUE(Receive(*channel, 1));
  ASSERT_EQ(channel->frames[0].pixels.size(), 320U * 64U);
  const auto full = RigImage(0);
  EXPECT_TRUE(std::equal(full.begin() + 63 * kRigWidth_px, full.begin() + 63 * kRigWidth_px + 320,
                         channel->frames[0].pixels.begin() + 63 * 320));
}

TEST(GigeLine, EdgesThatGiveNoFrameAreCounted) {
  GigeDeviceConfig config = SmallDevice("127.0.0.1");
  config.image = [](std::uint64_t tag) {
    return tag == 7 ? std::make_shared<const std::vector<std::uint8_t>>(5) : SharedRigImage(tag);
  };
  const auto channel = Open(config, OptionsFor(config));
  EXPECT_TRUE(channel->device->armed());
  const std::int64_t start_ns = MonoNowNs() + kMs_ns;
  channel->device->Edge(start_ns, 7);                // an image of 5 bytes
  channel->device->Edge(start_ns + 10 * kMs_ns, 0);  // good
  channel->device->Edge(start_ns + 11 * kMs_ns, 1);  // while exposing
  channel->device->Edge(start_ns + 20 * kMs_ns, 2);  // good
  ASSERT_TRUE(Receive(*channel, 2));
  EXPECT_EQ(channel->frames[0].frame_id, 2U);
  EXPECT_EQ(channel->frames[1].frame_id, 3U);
  const GigeCounters counters = channel->device->counters();
  EXPECT_EQ(counters.image_errors, 1U);
  EXPECT_EQ(counters.edges_while_exposing, 1U);
  EXPECT_EQ(counters.frames_exposed, 3U);
}

}  // namespace
}  // namespace forgescan
