#include "services/report/judge_dimensions.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace forgescan {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kSameTemperatureK = 0.05;

JudgedDimension Unmeasured(const MeasuredDimension& from, const std::string& reason) {
  JudgedDimension to;
  to.name = from.name;
  to.nominal_mm = from.nominal_mm;
  to.measured_mm = kNan;
  to.deviation_mm = kNan;
  to.lower_mm = from.lower_mm;
  to.upper_mm = from.upper_mm;
  to.uncertainty_mm = kNan;
  to.temperature_degc = from.reference_degc;
  to.points = from.points;
  to.rejected_share = from.rejected_share;
  to.verdict = Verdict::kNotInspected;
  to.reason = reason;
  return to;
}

// Why there can be no verdict on this dimension; empty if there can.
std::string Obstacle(const MeasuredDimension& from, double cloud_degc) {
  if (!from.measured_mm.has_value() || !std::isfinite(*from.measured_mm)) {
    return from.reason.empty() ? "The points do not determine this size." : from.reason;
  }
  if (std::isfinite(from.reference_degc) &&
      !(std::abs(from.reference_degc - cloud_degc) <= kSameTemperatureK)) {
    return fmt::format("The limits hold for {:.1f} degC, but the points were scaled to {:.1f} degC.",
                       from.reference_degc, cloud_degc);
  }
  if (!from.expanded_uncertainty_mm.has_value() && !std::isfinite(from.fit_uncertainty_mm)) {
    return "The fit of this size does not know its uncertainty.";
  }
  return "";
}

JudgedDimension Judge(const MeasuredDimension& from, const UncertaintyBudget& budget, double cloud_degc) {
  if (const std::string obstacle = Obstacle(from, cloud_degc); !obstacle.empty()) {
    return Unmeasured(from, obstacle);
  }
  JudgedDimension to = Unmeasured(from, from.reason);
  to.measured_mm = *from.measured_mm;
  to.deviation_mm = to.measured_mm - to.nominal_mm;
  to.temperature_degc = cloud_degc;
  to.definition = from.definition;
  if (from.expanded_uncertainty_mm.has_value()) {
    to.uncertainty_mm = *from.expanded_uncertainty_mm;
  } else {
    to.uncertainty_terms = UncertaintyTerms(budget, from.influence, to.measured_mm, from.fit_uncertainty_mm);
    to.uncertainty_mm = ExpandedUncertaintyMm(to.uncertainty_terms);
  }
  to.verdict = JudgeSize(to.measured_mm, to.uncertainty_mm, to.lower_mm, to.upper_mm);
  if (to.verdict == Verdict::kNotInspected) {
    to.reason = "The limits or the stated uncertainty of this dimension cannot be used.";
  } else if (!from.reason.empty()) {
    // A value with a reservation decides nothing, neither for the part nor against it.
    to.verdict = Verdict::kNotDecidable;
  }
  return to;
}

}  // namespace

std::vector<JudgedDimension> JudgeDimensions(std::span<const MeasuredDimension> measured,
                                             const UncertaintyBudget& budget, double cloud_degc) {
  std::vector<JudgedDimension> judged;
  for (const MeasuredDimension& dimension : measured) {
    judged.push_back(Judge(dimension, budget, cloud_degc));
  }
  return judged;
}

std::vector<JudgedDimension> NotInspected(std::span<const MeasuredDimension> dimensions,
                                          const std::string& reason) {
  std::vector<JudgedDimension> judged;
  for (const MeasuredDimension& dimension : dimensions) {
    judged.push_back(Unmeasured(dimension, reason));
  }
  return judged;
}

}  // namespace forgescan
