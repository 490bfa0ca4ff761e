// The report service from a station's files, for its program and for replay.
#pragma once

#include <memory>

#include "services/common/service/service_parts.h"

namespace forgescan {

// Errors: those of [report], the design model, its features and the folder for results.
Result<std::shared_ptr<void>> MakeReportService(const ServiceParts& parts);

}  // namespace forgescan
