// The cooling unit and the scanner it cools, in simulated time: a thermal plant with one heat capacity and a
// thermoelectric cooler that lags.
#pragma once

#include <random>

#include "drivers/cooling/cooling.h"

namespace forgescan {

// Defaults: 40 W of electronics and 12 W/K of air put the scanner 3.3 K above ambient without cooling; a hot
// part in front of it adds 60 W and 5 K; the thermoelectric cooler takes at most 8 K off the air (paper).
struct CoolingSimConfig {
  double ambient_degc = 30;
  double electronics_w = 40;
  double heat_capacity_j_per_k = 2000;
  double flow_conductance_w_per_k = 12;
  double still_conductance_w_per_k = 1;  // pump off
  double flow_lpm = 600;
  double max_cooling_k = 8;
  double cooler_lag_s = 20;
  double hot_side_rise_k = 28;  // at full duty
  double noise_k = 0.01;        // standard deviation of a thermometer
  double humidity_pct = 50;     // NaN: no sensor
  double safe_duty = 0.3;
  double start_inside_degc = 30;
  std::uint64_t seed = 1;
};

struct CoolingSimFaults {
  bool inlet_dead = false;
  bool outlet_dead = false;
  bool outlet_frozen = false;  // keeps its last value
  double outlet_jump_k = 0;
  bool pump_dead = false;
  bool silent = false;  // no temperatures at all
};

class CoolingSim final : public CoolingUnit {
 public:
  explicit CoolingSim(const CoolingSimConfig& config = {});

  Status Send(const CoolingCommand& command) override;
  void Step(std::int64_t now_us) override;

  void SetFaults(const CoolingSimFaults& faults) { faults_ = faults; }
  void SetHeatLoad(double watts) { heat_load_w_ = watts; }
  void SetAmbient(double ambient_degc) { config_.ambient_degc = ambient_degc; }
  double inside_degc() const { return inside_degc_; }  // the truth
  const CoolingCommand& command() const { return command_; }

 private:
  void Integrate(double seconds);
  void CheckCommandAge();
  void Report();
  double Noisy(double degc);

  CoolingSimConfig config_;
  CoolingSimFaults faults_;
  std::mt19937_64 random_;
  CoolingCommand command_;
  CoolingUnitState state_ = CoolingUnitState::kBoot;
  double heat_load_w_ = 0;
  double inside_degc_;
  double cooled_k_ = 0;  // of the air, by the thermoelectric cooler, now
  double last_outlet_degc_;
  bool started_ = false;
  std::int64_t now_us_ = 0;
  std::int64_t last_command_us_ = 0;
  std::int64_t next_report_us_ = 0;
};

}  // namespace forgescan
