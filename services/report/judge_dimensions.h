// From measured sizes to judged ones: temperature, uncertainty, verdict.
#pragma once

#include <span>

#include "services/report/part_evaluator.h"
#include "services/report/uncertainty.h"
#include "services/report/verdict_rule.h"

namespace forgescan {

// `cloud_degc` is the temperature the points were scaled to. Limits that hold for another temperature (by
// more than 0.05 K) are not applied: the dimension is NOT_INSPECTED and says so. A NaN limit temperature
// means "as the cloud".
std::vector<JudgedDimension> JudgeDimensions(std::span<const MeasuredDimension> measured,
                                             const UncertaintyBudget& budget, double cloud_degc);

// The same dimensions without measured values, each NOT_INSPECTED for the reason.
std::vector<JudgedDimension> NotInspected(std::span<const MeasuredDimension> dimensions,
                                          const std::string& reason);

}  // namespace forgescan
