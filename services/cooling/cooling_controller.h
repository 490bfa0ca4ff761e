// Keeps the scanner at its temperature: PI with feed-forward, anti-windup and slew limit, thermometer checks,
// interlocks. Pure: events with their time in, command and interlock out.
#pragma once

#include <optional>
#include <string>

#include "services/cooling/cooling_config.h"
#include "services/cooling/sensor_check.h"

namespace forgescan {

// What the inspection may do, worst last. The values are those of cooling_state_t.
enum class Interlock : std::int8_t { kUnknown, kClear, kWarn, kStopInspection, kPowerOff };

// What the unit measured; NaN as in the driver.
struct CoolingInput {
  std::int64_t utime = 0;
  double inlet_degc = 0;
  double outlet_degc = 0;
  double ambient_degc = 0;
  double hot_side_degc = 0;
};

struct CoolingUnitReport {
  std::int64_t utime = 0;
  double flow_lpm = 0;
  bool pump_on = false;
  double humidity_pct = 0;  // NaN: no sensor
};

struct CoolingOutput {
  double duty = 0;  // 0..1
  bool pump_on = true;
  bool projector_off = false;
  bool sensor_power_off = false;
  Interlock interlock = Interlock::kUnknown;
  std::string reason;      // one sentence unless clear
  double inside_degc = 0;  // what is controlled; NaN: unknown
};

// Events: temperatures, unit report, link change, tick. All are legal at any time; before the first
// temperatures the interlock is kUnknown and the duty the safe one.
class CoolingController {
 public:
  explicit CoolingController(const CoolingConfig& config) : config_(config) {}

  void OnTemperatures(const CoolingInput& input);
  void OnUnit(const CoolingUnitReport& report);
  void OnLink(bool up) { link_up_ = up; }
  // Computes the command; call at a steady rate, e.g. every 200 ms.
  // Source: discrete PI with back-calculation, Tt = Kp / Ki; feed-forward from the ambient temperature.
  CoolingOutput Tick(std::int64_t now_us);

  // Bumpless: manual takes the present duty along, automatic continues from the manual one.
  void SetManual(std::optional<double> duty) { manual_duty_ = duty; }

 private:
  struct Judgement {
    Interlock interlock = Interlock::kClear;
    std::string reason;
  };

  void JudgeSensors();
  double Regulate(double dt_s);
  double DutyLimit();
  bool CoolerOff(std::int64_t now_us);
  Judgement Judge(std::int64_t now_us);
  double Slewed(double wanted, double dt_s) const;

  CoolingConfig config_;
  SensorCheck inlet_check_, outlet_check_;
  std::optional<CoolingInput> input_;
  std::optional<CoolingUnitReport> unit_;
  std::optional<double> manual_duty_;
  std::string sensor_fault_;
  bool link_up_ = false;
  bool fresh_ = false;       // temperatures are not stale
  double inside_degc_ = 0;   // NaN while no thermometer can be believed
  double difference_k_ = 0;  // outlet - inlet, slow mean, to go on with one thermometer
  double integral_ = 0;
  double duty_ = 0;
  Interlock level_ = Interlock::kClear;  // by temperature, with hysteresis
  bool hot_side_latched_ = false;
  bool dew_latched_ = false;
  std::optional<std::int64_t> blind_since_us_;
  std::optional<std::int64_t> no_flow_since_us_;
  std::optional<std::int64_t> last_tick_us_;
};

}  // namespace forgescan
