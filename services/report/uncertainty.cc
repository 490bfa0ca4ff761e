#include "services/report/uncertainty.h"

#include <cmath>

namespace forgescan {
namespace {

constexpr double kCoverageFactor = 2.0;

Status CheckTerm(const char* name, double value, double max) {
  if (!(value >= 0.0 && value <= max)) {
    return Fail(ErrorCode::kInvalidArgument, "uncertainty: {} is {}, allowed is 0 to {}", name, value, max);
  }
  return {};
}

}  // namespace

Status UncertaintyBudget::Check() const {
  RETURN_IF_ERROR(CheckTerm("view_matrix_mm", view_matrix_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("scanner_mm", scanner_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("refraction_mm", refraction_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("temperature_k", temperature_k, 200.0));
  return CheckTerm("expansion_slope_per_k", expansion_slope_per_k, 1e-3);
}

double ExpandedUncertaintyMm(const UncertaintyBudget& budget, double size_mm, double fit_mm) {
  const double thermal_mm = size_mm * budget.expansion_slope_per_k * budget.temperature_k;
  const double variance_mm2 = fit_mm * fit_mm + budget.view_matrix_mm * budget.view_matrix_mm +
                              budget.scanner_mm * budget.scanner_mm +
                              budget.refraction_mm * budget.refraction_mm + thermal_mm * thermal_mm;
  return kCoverageFactor * std::sqrt(variance_mm2);
}

}  // namespace forgescan
