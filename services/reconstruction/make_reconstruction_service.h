// The reconstruction service from a station's files, for its program and for replay.
#pragma once

#include <memory>

#include "services/common/service/service_parts.h"

namespace forgescan {

// Errors: those of [reconstruction], the pattern and the calibration.
Result<std::shared_ptr<void>> MakeReconstructionService(const ServiceParts& parts);

}  // namespace forgescan
