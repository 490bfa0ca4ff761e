// What comes over CAN and GigE Vision, and the text that says what CAN frames mean.
#include <cmath>
#include <cstring>

#include "drivers/can/can_msgpack.h"
#include "drivers/can/dbc.h"
#include "drivers/canopen/canopen_node.h"
#include "drivers/cooling/cooling_canopen.h"
#include "drivers/line/line_canopen.h"
#include "drivers/robot/robot_canopen.h"
#include "drivers/trigger/trigger_canopen.h"
#include "tests/fuzz/readers.h"
#include "tools/virtual_station/gige/registers.h"

namespace forgescan::fuzz {
namespace {

std::span<const std::uint8_t> BytesOf(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

// A bus on which only what a test puts there is heard.
class HeardBus final : public CanBus {
 public:
  Status Send(const CanFrame& frame) override { return CheckSendable(frame); }
  Status Drain() override { return {}; }
  int fd() const override { return -1; }
  void Hear(const CanFrame& frame) { Deliver(frame); }
};

std::string CanDatagram() {
  CanFrame frame{.id = 0x190, .length = 3, .data = {1, 2, 3}};
  const auto bytes = EncodeCanDatagram(frame, 1'700'000'000'000'000);
  return {bytes.begin(), bytes.end()};
}

Outcome ReadCanDatagram(const std::string& bytes) {
  return Judge(DecodeCanDatagram(BytesOf(bytes)), "", [](const CanFrame& frame) -> std::string {
    for (std::size_t i = frame.length; i < frame.data.size(); ++i) {
      if (frame.data[i] != 0) return "a frame with data beyond its length";
    }
    return frame.error ? "" : ProblemOf(CheckSendable(frame));
  });
}

// Frames as they come: identifier in two bytes, length, eight bytes; each a millisecond after the one before.
constexpr std::size_t kFrameBytes = 11;

Outcome ReadCanDevices(const std::string& bytes) {
  HeardBus bus;
  const auto robot = MakeCanRobot(bus);
  const auto trigger = MakeCanTrigger(bus);
  const auto cooling = MakeCanCooling(bus);
  const auto line = MakeCanLine(bus);
  canopen::CanopenNode node(RobotProtocol::kNode);
  RobotProtocol robot_protocol;
  TriggerProtocol trigger_protocol;
  CoolingProtocol cooling_protocol;
  LineProtocol line_protocol;
  for (std::size_t at = 0; at + kFrameBytes <= bytes.size(); at += kFrameBytes) {
    CanFrame frame;
    frame.id = (static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes[at])) << 8 |
                static_cast<std::uint8_t>(bytes[at + 1])) &
               kMaxStandardCanId;
    frame.length = std::min<std::uint8_t>(static_cast<std::uint8_t>(bytes[at + 2]), 8);
    std::memcpy(frame.data.data(), bytes.data() + at + 3, frame.length);
    frame.utime = static_cast<std::int64_t>(at) * 100;
    bus.Hear(frame);
    static_cast<void>(node.OnFrame(frame));
    static_cast<void>(robot_protocol.CommandOf(frame).ok());
    static_cast<void>(trigger_protocol.CommandOf(frame).ok());
    static_cast<void>(cooling_protocol.CommandOf(frame).ok());
    static_cast<void>(line_protocol.CommandOf(frame).ok());
    robot->Step(frame.utime);
    trigger->Step(frame.utime);
    cooling->Step(frame.utime);
    line->Step(frame.utime);
  }
  return {true, {}};
}

// Heartbeats that bring all devices up, answers to what is asked, then a frame of every identifier.
std::string DeviceFrames() {
  constexpr std::array<std::uint8_t, 4> kNodes = {0x10, 0x20, 0x30, 0x40};
  std::string bytes;
  const auto add = [&bytes](std::uint32_t id, const CanFrame& frame) {
    bytes += static_cast<char>(id >> 8);
    bytes += static_cast<char>(id & 0xff);
    bytes += static_cast<char>(frame.length);
    bytes.append(reinterpret_cast<const char*>(frame.data.data()), frame.data.size());
  };
  for (const std::uint8_t node : kNodes) {
    const CanFrame heartbeat = canopen::HeartbeatFrame(node, canopen::NmtState::kOperational);
    add(heartbeat.id, heartbeat);
  }
  for (const canopen::ObjectAddress& object : RobotProtocol::kObjects) {
    const std::uint32_t id = canopen::kSdoAnswerBase + RobotProtocol::kNode;
    add(id, canopen::SdoFrame(id, {canopen::SdoMessage::Kind::kReadAnswer, object, 1, 4}));
  }
  for (std::uint32_t base = 0x080; base < 0x600; base += 0x080) {
    for (const std::uint32_t node : kNodes) {
      for (const std::uint8_t length : std::array<std::uint8_t, 3>{8, 6, 4})
        add(base + node, CanFrame{.length = length, .data = {1, 1}});
    }
  }
  return bytes;
}

// A command as the camera takes it, up to its registers.
Outcome ReadGvcp(const std::string& bytes) {
  using namespace gige;
  const auto command = ParseGvcpCommand(BytesOf(bytes));
  if (!command.ok()) return {false, SentenceProblem(command.error(), "")};
  static RegisterFile registers({"v", "m", "s", "u", 1, 0x7f000001}, 2448, 2048, true);
  const auto resend = ParseResendRequest(*command);
  if (resend.ok() && resend->last_packet < resend->first_packet) return {true, "a resend of no packets"};
  for (std::size_t at = 0; at + 8 <= command->payload.size(); at += 8) {
    std::array<std::uint32_t, 2> words{};
    for (std::size_t i = 0; i < 8; ++i) words[i / 4] = words[i / 4] << 8 | command->payload[at + i];
    static_cast<void>(registers.Write(words[0], words[1]));
    const auto memory = registers.Read(words[0], words[1]);
    if (memory && memory->size() != words[1]) return {true, "memory of another length"};
    static_cast<void>(registers.Get(words[0] & 0xfffcU));
  }
  static_cast<void>(registers.settings());
  registers.Reset();
  return {true, {}};
}

std::vector<std::string> GvcpSeeds() {
  const auto command = [](int operation, const std::string& payload) {
    return std::string("\x42\x01\x00", 3) + static_cast<char>(operation) + '\0' +
           static_cast<char>(payload.size()) + std::string("\0\7", 2) + payload;
  };
  return {command(0x02, ""),
          command(0x40, std::string("\0\0\0\1\0\0\0\2\0\0\0\3", 12)),
          command(0x80, std::string("\0\0\x0a\0", 4)),
          command(0x82, std::string("\0\0\xa0\x18\0\0\0\1\0\0\x0d\4\x80\0\x05\xdc", 16)),
          command(0x84, std::string("\0\0\0\x48\0\0\0\x20", 8)),
          command(0x86, std::string("\0\0\0\xe8name", 8))};
}

}  // namespace

std::vector<Reader> Readers() {
  const auto dbc = [](const std::string& bytes) { return Judge(ParseDbc(bytes), ""); };
  return {{"can_datagram", 50'000, {CanDatagram()}, ReadCanDatagram},
          {"can_devices", 2000, {DeviceFrames()}, ReadCanDevices},
          {"gvcp", 20'000, GvcpSeeds(), ReadGvcp},
          {"dbc", 300, {RepositoryFile("drivers/can/station.dbc")}, dbc}};
}

}  // namespace forgescan::fuzz
