#include "services/report/uncertainty.h"

#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kCoverageFactor = 2.0;

Status CheckTerm(const char* name, double value, double max) {
  if (!(value >= 0.0 && value <= max)) {
    return Fail(ErrorCode::kInvalidArgument, "uncertainty: {} is {}, allowed is 0 to {}", name, value, max);
  }
  return {};
}

Influence BetweenTwoViews(double size_mm) {
  Influence influence;
  influence.outward = 2;
  for (const double side : {-1.0, 1.0}) {
    ViewInfluence view;
    view.view = side < 0 ? 0 : 1;
    view.shift.x() = side;
    view.stretch_mm = size_mm / 2;
    influence.views.push_back(view);
  }
  return influence;
}

// Of independent moves of every view.
double OfViews(const Influence& influence, double shift_mm, double turn_rad) {
  double variance = 0;
  for (const ViewInfluence& view : influence.views) {
    variance += shift_mm * shift_mm * view.shift.squaredNorm();
    variance += turn_rad * turn_rad * view.turn_mm.squaredNorm();
  }
  return std::sqrt(variance);
}

}  // namespace

Status UncertaintyBudget::Check() const {
  RETURN_IF_ERROR(CheckTerm("view_shift_mm", view_shift_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("view_turn_rad", view_turn_rad, 0.1));
  RETURN_IF_ERROR(CheckTerm("robot_shift_mm", robot_shift_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("robot_turn_rad", robot_turn_rad, 0.1));
  RETURN_IF_ERROR(CheckTerm("refraction_mm", refraction_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("patch_mm", patch_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("surface_mm", surface_mm, 10.0));
  RETURN_IF_ERROR(CheckTerm("scanner_scale", scanner_scale, 0.1));
  RETURN_IF_ERROR(CheckTerm("temperature_k", temperature_k, 200.0));
  RETURN_IF_ERROR(CheckTerm("view_temperature_k", view_temperature_k, 200.0));
  return CheckTerm("expansion_slope_per_k", expansion_slope_per_k, 1e-3);
}

std::vector<UncertaintyTerm> UncertaintyTerms(const UncertaintyBudget& budget, const Influence& influence,
                                              double size_mm, double fit_mm) {
  const Influence used = influence.views.empty() ? BetweenTwoViews(size_mm) : influence;
  double scale_mm = 0, stretch_mm = 0, stretch_squares = 0;
  for (const ViewInfluence& view : used.views) {
    scale_mm += view.scale_mm;
    stretch_mm += view.stretch_mm;
    stretch_squares += view.stretch_mm * view.stretch_mm;
  }
  const double slope = budget.expansion_slope_per_k;
  const double scatter_mm = influence.views.empty() ? fit_mm : influence.noise_mm;
  const double patch_mm = budget.patch_mm * used.patch;
  // With both errors no strict bound, but above the mean of 3 to 135 sizes drawn with either one twice the
  // other.
  const double extreme_mm =
      std::hypot(used.extreme.scatter * scatter_mm, used.extreme.patch * patch_mm) / std::numbers::sqrt3;
  return {{"scatter of the points", scatter_mm},
          {"form of the faces", used.form_mm},
          {"patches of a view", patch_mm},
          {"extreme of many readings", extreme_mm},
          {"view matrices", OfViews(used, budget.view_shift_mm, budget.view_turn_rad)},
          {"robot", OfViews(used, budget.robot_shift_mm, budget.robot_turn_rad)},
          {"refraction", OfViews(used, budget.refraction_mm, 0)},
          {"height of the surface", budget.surface_mm * std::abs(used.outward)},
          {"scale of the scanner", budget.scanner_scale * std::abs(scale_mm)},
          {"temperature of the part", slope * budget.temperature_k * std::abs(stretch_mm)},
          {"temperature between views", slope * budget.view_temperature_k * std::sqrt(stretch_squares)}};
}

double ExpandedUncertaintyMm(std::span<const UncertaintyTerm> terms) {
  double variance_mm2 = 0;
  for (const UncertaintyTerm& term : terms) variance_mm2 += term.standard_mm * term.standard_mm;
  return kCoverageFactor * std::sqrt(variance_mm2);
}

}  // namespace forgescan
