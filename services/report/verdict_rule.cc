#include "services/report/verdict_rule.h"

#include <fmt/format.h>

#include <cmath>

namespace forgescan {
namespace {

std::vector<std::string> NamesWith(std::span<const JudgedDimension> dimensions, Verdict verdict) {
  std::vector<std::string> names;
  for (const JudgedDimension& dimension : dimensions) {
    if (dimension.verdict == verdict) {
      names.push_back(dimension.name);
    }
  }
  return names;
}

std::string Reason(Verdict verdict, const std::vector<std::string>& names) {
  const std::string list = fmt::format("{}", fmt::join(names, ", "));
  switch (verdict) {
    case Verdict::kNotOk:
      return fmt::format("Outside its limits by more than the uncertainty: {}.", list);
    case Verdict::kNotDecidable:
      return fmt::format("Too close to a limit for the uncertainty of the measurement: {}.", list);
    default:
      return fmt::format("Not measured: {}.", list);
  }
}

}  // namespace

std::string_view VerdictText(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "OK";
    case Verdict::kNotOk:
      return "NOT_OK";
    case Verdict::kNotDecidable:
      return "NOT_DECIDABLE";
    case Verdict::kNotInspected:
      return "NOT_INSPECTED";
    case Verdict::kUnknown:
      break;
  }
  return "UNKNOWN";
}

Verdict VerdictFromNumber(std::int64_t number) {
  return number >= 0 && number <= 4 ? static_cast<Verdict>(number) : Verdict::kUnknown;
}

Verdict JudgeSize(double measured_mm, double uncertainty_mm, double lower_mm, double upper_mm) {
  const bool known = std::isfinite(measured_mm) && std::isfinite(uncertainty_mm) && std::isfinite(lower_mm) &&
                     std::isfinite(upper_mm);
  if (!known || uncertainty_mm < 0.0 || lower_mm > upper_mm) {
    return Verdict::kNotInspected;
  }
  if (measured_mm < lower_mm - uncertainty_mm || measured_mm > upper_mm + uncertainty_mm) {
    return Verdict::kNotOk;
  }
  const bool inside = lower_mm + uncertainty_mm <= measured_mm && measured_mm <= upper_mm - uncertainty_mm;
  return inside ? Verdict::kOk : Verdict::kNotDecidable;
}

PartVerdict JudgePart(std::span<const JudgedDimension> dimensions) {
  if (dimensions.empty()) {
    return {Verdict::kNotInspected, "The part has no dimension that could be judged."};
  }
  for (const Verdict verdict :
       {Verdict::kNotOk, Verdict::kNotInspected, Verdict::kUnknown, Verdict::kNotDecidable}) {
    if (const auto names = NamesWith(dimensions, verdict); !names.empty()) {
      return {verdict == Verdict::kUnknown ? Verdict::kNotInspected : verdict, Reason(verdict, names)};
    }
  }
  return {Verdict::kOk, ""};
}

}  // namespace forgescan
