#include "drivers/robot/robot_canopen.h"

#include "drivers/can/station_frames.h"

namespace forgescan {
namespace {

RobotStatus FromWire(const station::RobotStatus& wire, std::int64_t utime) {
  return {.utime = utime,
          .seq_echo = wire.seq_echo,
          .state = static_cast<RobotState>(wire.state),
          .in_position = wire.in_position,
          .automatic = wire.automatic,
          .drives_on = wire.drives_on,
          .warm = wire.warm,
          .protective_stop = wire.protective_stop,
          .path_valid = wire.path_valid,
          .path = wire.path,
          .view = wire.view};
}

station::RobotStatus ToWire(const RobotStatus& status) {
  station::RobotStatus wire;
  wire.seq_echo = status.seq_echo;
  wire.state = static_cast<station::RobotStatus::State>(status.state);
  wire.in_position = status.in_position;
  wire.automatic = status.automatic;
  wire.drives_on = status.drives_on;
  wire.warm = status.warm;
  wire.protective_stop = status.protective_stop;
  wire.path_valid = status.path_valid;
  wire.path = status.path;
  wire.view = status.view;
  return wire;
}

Result<std::vector<CanFrame>> One(Result<CanFrame> frame) {
  if (!frame.ok()) {
    return frame.error();
  }
  return std::vector<CanFrame>{*frame};
}

}  // namespace

Result<std::vector<CanFrame>> RobotProtocol::FramesOf(const RobotCommand& command) {
  station::RobotCommand wire;
  wire.seq = command.seq;
  wire.command = static_cast<station::RobotCommand::Command>(command.order);
  wire.path = command.path;
  wire.view = command.view;
  return One(wire.Encode());
}

Result<std::optional<RobotCommand>> RobotProtocol::CommandOf(const CanFrame& frame) {
  if (frame.id != station::RobotCommand::kId) {
    return std::optional<RobotCommand>();
  }
  ASSIGN_OR_RETURN(const auto wire, station::RobotCommand::Decode(frame));
  return std::optional(RobotCommand{wire.seq, static_cast<RobotOrder>(wire.command), wire.path, wire.view});
}

Result<std::optional<RobotEvent>> RobotProtocol::EventOf(const CanFrame& frame) {
  if (frame.id == station::RobotStatus::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::RobotStatus::Decode(frame));
    return std::optional<RobotEvent>(FromWire(wire, frame.utime));
  }
  if (frame.id == station::RobotMotion::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::RobotMotion::Decode(frame));
    return std::optional<RobotEvent>(
        RobotMotion{frame.utime, wire.in_position_ms, wire.body_degc, wire.override_pct});
  }
  return std::optional<RobotEvent>();
}

Result<std::vector<CanFrame>> RobotProtocol::FramesOf(const RobotEvent& event) {
  if (const auto* status = std::get_if<RobotStatus>(&event)) {
    return One(ToWire(*status).Encode());
  }
  if (const auto* motion = std::get_if<RobotMotion>(&event)) {
    station::RobotMotion wire;
    wire.in_position_ms = motion->in_position_ms;
    wire.body_degc = motion->body_degc;
    wire.override_pct = motion->override_pct;
    return One(wire.Encode());
  }
  return std::vector<CanFrame>();
}

std::optional<RobotEvent> RobotProtocol::EventOfObjects(
    const std::map<canopen::ObjectAddress, std::uint32_t>& objects) {
  if (objects.size() < kObjects.size()) {
    return std::nullopt;
  }
  const auto at = [&](std::size_t i) { return objects.at(kObjects[i]); };
  return RobotPath{static_cast<std::uint16_t>(at(0)), at(1), static_cast<std::uint16_t>(at(2)),
                   static_cast<std::uint16_t>(at(3))};
}

std::map<canopen::ObjectAddress, canopen::ObjectEntry> RobotProtocol::ObjectsOf(const RobotEvent& event) {
  const auto* path = std::get_if<RobotPath>(&event);
  if (path == nullptr) {
    return {};
  }
  return {{kObjects[0], {path->view_count, 2}},
          {kObjects[1], {path->crc32, 4}},
          {kObjects[2], {path->settle_ms, 2}},
          {kObjects[3], {path->move_timeout_ms, 2}}};
}

std::unique_ptr<Robot> MakeCanRobot(CanBus& bus) { return std::make_unique<CanopenHost<RobotProtocol>>(bus); }

}  // namespace forgescan
