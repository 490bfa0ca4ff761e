// The fusion service from a station's files, for its program and for replay.
#pragma once

#include <memory>

#include "services/common/service/service_parts.h"

namespace forgescan {

// Errors: those of [fusion] and the view matrices.
Result<std::shared_ptr<void>> MakeFusionService(const ServiceParts& parts);

}  // namespace forgescan
