#include "tools/virtual_station/thermal.h"

#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kLowestDegc = 20.0;
constexpr double kHighestDegc = 1200.0;
constexpr double kZeroDegcInKelvin = 273.15;
constexpr double kStefanBoltzmann = 5.670374419e-8;  // W/(m2 K4)

Status CheckTemperature(double temperature_degc) {
  if (!(temperature_degc >= kLowestDegc && temperature_degc <= kHighestDegc)) {
    return Fail(ErrorCode::kInvalidArgument,
                "part temperature is {} degC, the steel tables hold from {} to {} degC", temperature_degc,
                kLowestDegc, kHighestDegc);
  }
  return {};
}

double FourthPower(double x) { return x * x * x * x; }

}  // namespace

Result<double> ThermalStrain(double temperature_degc) {
  RETURN_IF_ERROR(CheckTemperature(temperature_degc));
  const double t = temperature_degc;
  if (t <= 750.0) {
    return 1.2e-5 * t + 0.4e-8 * t * t - 2.416e-4;
  }
  if (t <= 860.0) {
    return 1.1e-2;
  }
  return 2e-5 * t - 6.2e-3;
}

Result<double> SizeScale(double temperature_degc, double reference_degc) {
  ASSIGN_OR_RETURN(const double strain, ThermalStrain(temperature_degc));
  ASSIGN_OR_RETURN(const double reference_strain, ThermalStrain(reference_degc));
  return (1.0 + strain) / (1.0 + reference_strain);
}

Result<double> SpecificHeat(double temperature_degc) {
  RETURN_IF_ERROR(CheckTemperature(temperature_degc));
  const double t = temperature_degc;
  if (t >= 900.0) {
    return 650.0;
  }
  if (t >= 735.0) {
    return 545.0 + 17820.0 / (t - 731.0);
  }
  if (t >= 600.0) {
    return 666.0 + 13002.0 / (738.0 - t);
  }
  return 425.0 + t * (0.773 + t * (-1.69e-3 + t * 2.22e-6));
}

Result<double> CoolingRate(const CoolingLaw& law, double temperature_degc) {
  ASSIGN_OR_RETURN(const double heat, SpecificHeat(temperature_degc));
  const double radiated =
      law.emissivity * kStefanBoltzmann *
      (FourthPower(temperature_degc + kZeroDegcInKelvin) - FourthPower(law.ambient_degc + kZeroDegcInKelvin));
  const double convected = law.convection_w_per_m2k * (temperature_degc - law.ambient_degc);
  const double perimeter_per_area = 4.0 / (1e-3 * law.bar_diameter_mm);  // 1/m
  return -(radiated + convected) * perimeter_per_area / (law.density_kg_per_m3 * heat);
}

Result<double> TemperatureAfter(const CoolingLaw& law, double start_degc, double elapsed_s) {
  if (!(elapsed_s >= 0.0 && elapsed_s <= 1e5)) {
    return Fail(ErrorCode::kInvalidArgument, "cooling time is {} s, allowed 0 to 100000 s", elapsed_s);
  }
  const int steps = static_cast<int>(std::ceil(elapsed_s / 0.25));
  const double step_s = steps > 0 ? elapsed_s / steps : 0.0;
  double t = start_degc;
  for (int i = 0; i < steps; ++i) {
    ASSIGN_OR_RETURN(const double k1, CoolingRate(law, t));
    ASSIGN_OR_RETURN(const double k2, CoolingRate(law, t + 0.5 * step_s * k1));
    ASSIGN_OR_RETURN(const double k3, CoolingRate(law, t + 0.5 * step_s * k2));
    ASSIGN_OR_RETURN(const double k4, CoolingRate(law, t + step_s * k3));
    t += step_s * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
  }
  RETURN_IF_ERROR(CheckTemperature(t));
  return t;
}

}  // namespace forgescan
