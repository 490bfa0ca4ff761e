// The resend protocol on the real bus with Debian's default kernel buffers, where nearly every camera frame
// is lost at first.
#include <gtest/gtest.h>

#include <memory>

#include "services/common/bus/channels.h"
#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

TEST(StreamOnLcm, ResendCarriesFramesThroughDefaultBuffers) {
  constexpr int kFrames = 8;
  constexpr char kUrl[] =
      "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=106496";  // the kernel makes 212992 of it
  auto sender_bus = LcmBus::Open(kUrl), receiver_bus = LcmBus::Open(kUrl);
  ASSERT_TRUE(sender_bus.ok() && receiver_bus.ok());
  StreamHub receiver(**receiver_bus, "receiver");
  std::vector<std::int64_t> ids;
  receiver.Subscribe<fsmsg::frame_t>(kFrameLeft,
                                     [&](const fsmsg::frame_t& frame) { ids.push_back(frame.frame_id); });
  StreamHub sender(**sender_bus, "sender");
  std::vector<std::int64_t> sent;
  for (int i = 1; i <= kFrames; ++i) {
    fsmsg::frame_t frame{};
    frame.frame_id = i;
    frame.data.assign(5'013'504, static_cast<std::uint8_t>(i));
    frame.size = static_cast<std::int32_t>(frame.data.size());
    ASSERT_TRUE(sender.Publish(kFrameLeft, frame).ok());
    sent.push_back(i);
  }
  const std::int64_t until_us = sender.bus().NowUs() + 60'000'000;
  while (ids.size() < kFrames && sender.bus().NowUs() < until_us) {
    ASSERT_TRUE((*sender_bus)->RunOnce(200).ok());
    ASSERT_TRUE((*receiver_bus)->RunOnce(200).ok());
  }
  EXPECT_EQ(ids, sent);
  EXPECT_EQ(receiver.counters().missing, 0);
  RecordProperty("recovered", static_cast<int>(receiver.counters().recovered));
}

}  // namespace
}  // namespace forgescan
