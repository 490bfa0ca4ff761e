// Thermal expansion of the part's steel, from a dilatometer table in the station's configuration.
#pragma once

#include <vector>

#include "services/common/result.h"

namespace forgescan {

// Relative elongation eps(T) = (L(T) - L(20 degC)) / L(20 degC), linear between the points of a table.
class ExpansionCurve {
 public:
  // temperatures_degc strictly increasing, at least 2; elongations (1) of the same length, |eps| < 0.1.
  // Errors: kInvalidArgument.
  static Result<ExpansionCurve> Create(std::vector<double> temperatures_degc,
                                       std::vector<double> elongations);

  // Factor that takes a length at `from_degc` to `to_degc`: (1 + eps(to)) / (1 + eps(from)).
  // Source: forgings' correction before fusion, docs/design.md "Hot sizes". Errors: kInvalidArgument (not a
  // number, or outside the table: elongation is never extrapolated).
  Result<double> Scale(double from_degc, double to_degc) const;

 private:
  Result<double> Elongation(double temperature_degc) const;

  std::vector<double> temperatures_degc_;
  std::vector<double> elongations_;
};

}  // namespace forgescan
