// The registration service from a station's files, for its program and for replay.
#pragma once

#include <memory>

#include "services/common/service/service_parts.h"

namespace forgescan {

// Errors: those of [registration] and the design model.
Result<std::shared_ptr<void>> MakeRegistrationService(const ServiceParts& parts);

}  // namespace forgescan
