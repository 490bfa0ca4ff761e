// Bytes in JSON.
#pragma once

#include <string>

#include "services/common/bus/bus.h"

namespace forgescan {

// RFC 4648, section 4, with padding.
std::string Base64(ByteView bytes);

}  // namespace forgescan
