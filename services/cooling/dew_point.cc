#include "services/cooling/dew_point.h"

#include <cmath>

namespace forgescan {

Result<double> DewPoint_degc(double air_degc, double humidity_pct) {
  if (!(air_degc >= -40 && air_degc <= 60 && humidity_pct >= 1 && humidity_pct <= 100)) {
    return Fail(ErrorCode::kInvalidArgument, "dew point of {} degC at {} % is outside -40..60 degC, 1..100 %",
                air_degc, humidity_pct);
  }
  const double g = std::log(humidity_pct / 100) + 17.625 * air_degc / (243.04 + air_degc);
  return 243.04 * g / (17.625 - g);
}

}  // namespace forgescan
