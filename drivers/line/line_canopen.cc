#include "drivers/line/line_canopen.h"

#include <algorithm>

#include "drivers/can/station_frames.h"

namespace forgescan {
namespace {

Result<std::vector<CanFrame>> One(Result<CanFrame> frame) {
  if (!frame.ok()) {
    return frame.error();
  }
  return std::vector<CanFrame>{*frame};
}

Result<std::vector<CanFrame>> PartFrames(const LinePart& part) {
  constexpr std::uint32_t kLongest_ms = 0xFFFFFF;
  station::LinePart wire;
  wire.part = part.part;
  wire.in_place = part.in_place;
  wire.clamped = part.clamped;
  wire.running = part.running;
  wire.in_place_ms = std::min(part.in_place_ms, kLongest_ms);
  return One(wire.Encode());
}

Result<std::vector<CanFrame>> EchoFrames(const LineSortEcho& echo) {
  station::LineSortEcho wire;
  wire.part = echo.part;
  wire.verdict = static_cast<station::LineSortEcho::Verdict>(echo.verdict);
  wire.gate = static_cast<station::LineSortEcho::Gate>(echo.gate);
  wire.seq_echo = echo.seq_echo;
  return One(wire.Encode());
}

}  // namespace

Result<std::vector<CanFrame>> LineProtocol::FramesOf(const LineCommand& command) {
  station::LineSort wire;
  wire.part = command.part;
  wire.verdict = static_cast<station::LineSort::Verdict>(command.verdict);
  wire.seq = command.seq;
  return One(wire.Encode());
}

Result<std::optional<LineCommand>> LineProtocol::CommandOf(const CanFrame& frame) {
  if (frame.id != station::LineSort::kId) {
    return std::optional<LineCommand>();
  }
  ASSIGN_OR_RETURN(const auto wire, station::LineSort::Decode(frame));
  return std::optional(LineCommand{wire.part, static_cast<LineVerdict>(wire.verdict), wire.seq});
}

Result<std::optional<LineEvent>> LineProtocol::EventOf(const CanFrame& frame) {
  if (frame.id == station::LinePart::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::LinePart::Decode(frame));
    return std::optional<LineEvent>(
        LinePart{frame.utime, wire.part, wire.in_place, wire.clamped, wire.running, wire.in_place_ms});
  }
  if (frame.id == station::LinePyrometer::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::LinePyrometer::Decode(frame));
    return std::optional<LineEvent>(LinePyrometer{frame.utime, wire.part, wire.part_degc, wire.valid});
  }
  if (frame.id == station::LineSortEcho::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::LineSortEcho::Decode(frame));
    return std::optional<LineEvent>(LineSortEcho{frame.utime, wire.part,
                                                 static_cast<LineVerdict>(wire.verdict),
                                                 static_cast<GateState>(wire.gate), wire.seq_echo});
  }
  return std::optional<LineEvent>();
}

Result<std::vector<CanFrame>> LineProtocol::FramesOf(const LineEvent& event) {
  if (const auto* part = std::get_if<LinePart>(&event)) {
    return PartFrames(*part);
  }
  if (const auto* pyrometer = std::get_if<LinePyrometer>(&event)) {
    station::LinePyrometer wire;
    wire.part = pyrometer->part;
    wire.part_degc = pyrometer->part_degc;
    wire.valid = pyrometer->valid;
    return One(wire.Encode());
  }
  if (const auto* echo = std::get_if<LineSortEcho>(&event)) {
    return EchoFrames(*echo);
  }
  return std::vector<CanFrame>();
}

std::unique_ptr<LineSignals> MakeCanLine(CanBus& bus) {
  return std::make_unique<CanopenHost<LineProtocol>>(bus);
}

}  // namespace forgescan
