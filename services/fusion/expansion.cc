#include "services/fusion/expansion.h"

#include <algorithm>
#include <cmath>

namespace forgescan {

Result<ExpansionCurve> ExpansionCurve::Create(std::vector<double> temperatures_degc,
                                              std::vector<double> elongations) {
  if (temperatures_degc.size() < 2 || temperatures_degc.size() != elongations.size()) {
    return Fail(ErrorCode::kInvalidArgument,
                "an expansion table has {} temperatures and {} elongations; it needs at least 2 of each",
                temperatures_degc.size(), elongations.size());
  }
  if (std::adjacent_find(temperatures_degc.begin(), temperatures_degc.end(), std::greater_equal<>()) !=
      temperatures_degc.end()) {
    return Fail(ErrorCode::kInvalidArgument, "the temperatures of an expansion table must increase");
  }
  if (std::any_of(elongations.begin(), elongations.end(), [](double e) { return !(std::abs(e) < 0.1); })) {
    return Fail(ErrorCode::kInvalidArgument,
                "the elongations of an expansion table must lie within -0.1 to 0.1");
  }
  ExpansionCurve curve;
  curve.temperatures_degc_ = std::move(temperatures_degc);
  curve.elongations_ = std::move(elongations);
  return curve;
}

Result<double> ExpansionCurve::Elongation(double temperature_degc) const {
  const auto& t = temperatures_degc_;
  if (!(temperature_degc >= t.front() && temperature_degc <= t.back())) {
    return Fail(ErrorCode::kInvalidArgument,
                "a part temperature of {:.1f} degC is outside the expansion table, {} to {} degC",
                temperature_degc, t.front(), t.back());
  }
  const auto above = std::upper_bound(t.begin() + 1, t.end() - 1, temperature_degc);
  const auto i = static_cast<std::size_t>(above - t.begin());
  const double share = (temperature_degc - t[i - 1]) / (t[i] - t[i - 1]);
  return elongations_[i - 1] + share * (elongations_[i] - elongations_[i - 1]);
}

Result<double> ExpansionCurve::Scale(double from_degc, double to_degc) const {
  ASSIGN_OR_RETURN(const double from, Elongation(from_degc));
  ASSIGN_OR_RETURN(const double to, Elongation(to_degc));
  return (1.0 + to) / (1.0 + from);
}

}  // namespace forgescan
