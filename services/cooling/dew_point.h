// At which temperature the air begins to condense.
#pragma once

#include "services/common/result.h"

namespace forgescan {

// Source: Magnus formula with the constants of Alduchov and Eskridge (17.625, 243.04 degC); +-0.35 K for
// -40..60 degC. Units: degC, relative humidity in percent. Errors: kInvalidArgument when the humidity is
// outside 1..100 or the temperature outside -40..60.
Result<double> DewPoint_degc(double air_degc, double humidity_pct);

}  // namespace forgescan
