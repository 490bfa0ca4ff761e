// The production camera driver opens the virtual camera, or says why it cannot.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include "tests/tools/virtual_station/gige/gige_channel.h"
#include "tests/tools/virtual_station/gige/gvcp_command.h"
#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/registers.h"
#include "tools/virtual_station/gige/socket.h"

namespace forgescan {
namespace {

TEST(GigeOpening, CameraHeldByAnotherIsUnavailableUntilReleased) {
  const GigeDeviceConfig config = SmallDevice("127.0.0.1");
  const auto channel = Open(config, OptionsFor(config));
  CameraAravis second(OptionsFor(config));
  const Status refused = second.Start();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable) << refused.error().message;
  EXPECT_EQ(second.state(), Camera::State::kClosed);
  channel->camera = nullptr;
  const Status started = second.Start();
  EXPECT_TRUE(started.ok()) << started.error().message;
}

TEST(GigeOpening, TheCameraIsToldHowLongAServiceThatDiedHoldsIt) {
  const GigeDeviceConfig config = SmallDevice("127.0.0.1");
  const auto device = GigeDevice::Create(config);
  ASSERT_TRUE(device.ok()) << device.error().message;
  CameraAravisOptions options = OptionsFor(config);
  options.heartbeat_timeout_ms = 2345;
  CameraAravis camera(options);
  ASSERT_TRUE(camera.Start().ok());
  const auto socket = gige::UdpSocket::Bind(0x7f000001, 0, false);
  ASSERT_TRUE(socket.ok());
  const gige::Bytes question =
      gige::Command(gige::GvcpOperation::kReadRegister, {gige::reg::kHeartbeatTimeout});
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(0x7f000001);
  to.sin_port = htons(gige::kGvcpPort);
  ASSERT_GT(::sendto(socket->fd(), question.data(), question.size(), 0,
                     reinterpret_cast<const sockaddr*>(&to), sizeof to),
            0);
  pollfd readable{socket->fd(), POLLIN, 0};
  ASSERT_EQ(::poll(&readable, 1, 5000), 1);
  gige::Bytes reply(64);
  ASSERT_EQ(::recv(socket->fd(), reply.data(), reply.size(), 0), 12);
  EXPECT_EQ(gige::Get32(reply, 8), 2345U);
}

TEST(GigeOpening, AddressWithoutCameraIsUnavailable) {
  GigeDeviceConfig config = SmallDevice("127.0.0.3");
  CameraAravis camera(OptionsFor(config));
  const Status started = camera.Start();
  ASSERT_FALSE(started.ok());
  EXPECT_EQ(started.error().code, ErrorCode::kUnavailable) << started.error().message;
}

TEST(GigeOpening, SettingTheCameraDoesNotHaveIsRefused) {
  const GigeDeviceConfig config = SmallDevice("127.0.0.1");
  const auto device = GigeDevice::Create(config);
  ASSERT_TRUE(device.ok()) << device.error().message;
  CameraAravisOptions wide = OptionsFor(config);
  wide.width_px = 4000;  // the sensor has 640
  CameraAravisOptions odd_line = OptionsFor(config);
  odd_line.trigger_source = "Line7";
  for (const CameraAravisOptions& options : {wide, odd_line}) {
    CameraAravis camera(options);
    const Status started = camera.Start();
    ASSERT_FALSE(started.ok());
    EXPECT_EQ(started.error().code, ErrorCode::kProtocol) << started.error().message;
  }
  CameraAravis camera(OptionsFor(config));
  EXPECT_TRUE(camera.Start().ok());
}

TEST(GigeOpening, OptionsOutOfRangeAreRefusedBeforeAnythingIsSent) {
  CameraAravisOptions options = OptionsFor(SmallDevice("127.0.0.1"));
  EXPECT_TRUE(options.Check().ok());
  options.address = "camera one";
  EXPECT_EQ(CameraAravis(options).Start().error().code, ErrorCode::kInvalidArgument);
  options = OptionsFor(SmallDevice("127.0.0.1"));
  options.packet_size_bytes = 100;
  EXPECT_EQ(options.Check().error().code, ErrorCode::kInvalidArgument);
  options = OptionsFor(SmallDevice("127.0.0.1"));
  options.buffers = 0;
  EXPECT_EQ(options.Check().error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan
