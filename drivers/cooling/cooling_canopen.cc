#include "drivers/cooling/cooling_canopen.h"

#include <cmath>
#include <limits>

#include "drivers/can/station_frames.h"

namespace forgescan {
namespace {

constexpr double kNoThermometer_degc = -327.68;  // on the wire
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double FromWire(double degc) { return degc == kNoThermometer_degc ? kNaN : degc; }
double ToWire(double degc) { return std::isnan(degc) ? kNoThermometer_degc : degc; }

CoolingStatus FromWire(const station::CoolingStatus& wire, std::int64_t utime) {
  return {.utime = utime,
          .state = static_cast<CoolingUnitState>(wire.state),
          .duty = wire.duty_pct / 100,
          .flow_lpm = wire.flow_lpm,
          .pump_on = wire.pump_on,
          .projector_off = wire.projector_off,
          .sensor_power_off = wire.sensor_power_off,
          .humidity_pct = wire.has_humidity ? static_cast<double>(wire.humidity_pct) : kNaN};
}

station::CoolingStatus ToWire(const CoolingStatus& status) {
  station::CoolingStatus wire;
  wire.state = static_cast<station::CoolingStatus::State>(status.state);
  wire.duty_pct = 100 * status.duty;
  wire.flow_lpm = status.flow_lpm;
  wire.pump_on = status.pump_on;
  wire.projector_off = status.projector_off;
  wire.sensor_power_off = status.sensor_power_off;
  wire.has_humidity = status.humidity_pct >= 0 && status.humidity_pct <= 100;
  wire.humidity_pct =
      wire.has_humidity ? static_cast<std::uint8_t>(std::lround(status.humidity_pct)) : std::uint8_t{0};
  return wire;
}

}  // namespace

Result<std::vector<CanFrame>> CoolingProtocol::FramesOf(const CoolingCommand& command) {
  station::CoolingCommand wire;
  wire.duty_pct = 100 * command.duty;
  wire.pump_on = command.pump_on;
  wire.projector_off = command.projector_off;
  wire.sensor_power_off = command.sensor_power_off;
  wire.counter = counter_++;
  ASSIGN_OR_RETURN(const CanFrame frame, wire.Encode());
  return std::vector<CanFrame>{frame};
}

Result<std::optional<CoolingCommand>> CoolingProtocol::CommandOf(const CanFrame& frame) {
  if (frame.id != station::CoolingCommand::kId) {
    return std::optional<CoolingCommand>();
  }
  ASSIGN_OR_RETURN(const auto wire, station::CoolingCommand::Decode(frame));
  counter_ = wire.counter;
  return std::optional(
      CoolingCommand{wire.duty_pct / 100, wire.pump_on, wire.projector_off, wire.sensor_power_off});
}

Result<std::optional<CoolingEvent>> CoolingProtocol::EventOf(const CanFrame& frame) {
  if (frame.id == station::CoolingTemperatures::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::CoolingTemperatures::Decode(frame));
    return std::optional<CoolingEvent>(
        CoolingTemperatures{frame.utime, FromWire(wire.inlet_degc), FromWire(wire.outlet_degc),
                            FromWire(wire.ambient_degc), FromWire(wire.hot_side_degc)});
  }
  if (frame.id == station::CoolingStatus::kId) {
    ASSIGN_OR_RETURN(const auto wire, station::CoolingStatus::Decode(frame));
    return std::optional<CoolingEvent>(FromWire(wire, frame.utime));
  }
  return std::optional<CoolingEvent>();
}

Result<std::vector<CanFrame>> CoolingProtocol::FramesOf(const CoolingEvent& event) {
  if (const auto* temperatures = std::get_if<CoolingTemperatures>(&event)) {
    station::CoolingTemperatures wire;
    wire.inlet_degc = ToWire(temperatures->inlet_degc);
    wire.outlet_degc = ToWire(temperatures->outlet_degc);
    wire.ambient_degc = ToWire(temperatures->ambient_degc);
    wire.hot_side_degc = ToWire(temperatures->hot_side_degc);
    ASSIGN_OR_RETURN(const CanFrame frame, wire.Encode());
    return std::vector<CanFrame>{frame};
  }
  if (const auto* status = std::get_if<CoolingStatus>(&event)) {
    station::CoolingStatus wire = ToWire(*status);
    wire.counter_echo = counter_;
    ASSIGN_OR_RETURN(const CanFrame frame, wire.Encode());
    return std::vector<CanFrame>{frame};
  }
  return std::vector<CanFrame>();
}

std::unique_ptr<CoolingUnit> MakeCanCooling(CanBus& bus) {
  return std::make_unique<CanopenHost<CoolingProtocol>>(bus);
}

}  // namespace forgescan
