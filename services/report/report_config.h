// [report] of the station file.
#pragma once

#include <cstdint>

#include "services/common/config/config.h"
#include "services/common/features/dimensions.h"
#include "services/report/uncertainty.h"

namespace forgescan {

struct ReportConfig {
  double part_timeout_s =
      180.0;  // from the first word of a part to its verdict; above scan, fusion and registration
  double loss_settle_s = 2.0;       // between looks at parts that may lack a lost message
  double page_delay_s = 0.5;        // from the verdict to the page: durations that come late still get on it
  int trend_parts = 25;             // last parts drawn and fitted
  int index_parts = 200;            // last parts listed in index.html
  double deviation_scale_mm = 1.0;  // the colours of the picture end here
  int picture_width_px = 2000;
  UncertaintyBudget uncertainty;
  DimensionOptions dimensions;

  // Reads the table and the tables `uncertainty` and `dimensions` in it. Errors: as ConfigTable, then
  // Check().
  static Result<ReportConfig> Load(ConfigTable table);
  Status Check() const;
  std::int64_t part_timeout_us() const { return static_cast<std::int64_t>(part_timeout_s * 1e6); }
  std::int64_t loss_settle_us() const { return static_cast<std::int64_t>(loss_settle_s * 1e6); }
};

}  // namespace forgescan
