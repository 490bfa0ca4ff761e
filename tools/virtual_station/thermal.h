// How hot the part is, and how large that makes it.
//
// Source: carbon steel of EN 1993-1-2 (thermal elongation, specific heat); radiation and convection of a bar.
// Units: degC, s, mm; strains are fractions of the length at 20 degC.
#pragma once

#include "services/common/result.h"
#include "tools/virtual_station/random.h"

namespace forgescan {

// A long bar that loses heat over its whole circumference and is equally warm throughout.
struct CoolingLaw {
  double emissivity = 0.8;
  double convection_w_per_m2k = 20.0;
  double ambient_degc = 30.0;
  double bar_diameter_mm = 90.0;
  double density_kg_per_m3 = 7850.0;
};

// (L(T) - L(20)) / L(20). Errors: kInvalidArgument outside 20 to 1200 degC.
Result<double> ThermalStrain(double temperature_degc);

// L(T) / L(reference). Errors: as ThermalStrain.
Result<double> SizeScale(double temperature_degc, double reference_degc);

// J/(kg K). Errors: kInvalidArgument outside 20 to 1200 degC.
Result<double> SpecificHeat(double temperature_degc);

// dT/dt in K/s, negative above ambient. Errors: as SpecificHeat.
Result<double> CoolingRate(const CoolingLaw& law, double temperature_degc);

// The temperature `elapsed_s` after it was `start_degc` (fourth-order Runge-Kutta, steps <= 0.25 s).
// Errors: kInvalidArgument for a negative or non-finite time, or where it leaves 20 to 1200 degC.
Result<double> TemperatureAfter(const CoolingLaw& law, double start_degc, double elapsed_s);

// A pyrometer that is wrong by a constant of its own and by noise of every reading.
struct Pyrometer {
  double bias_k = 0.0;
  double noise_sd_k = 0.0;

  double Read(double true_degc, RandomStream& random) const {
    return true_degc + bias_k + noise_sd_k * random.Gaussian();
  }
};

}  // namespace forgescan
