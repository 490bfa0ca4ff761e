// Images of the bus as files people can open.
#pragma once

#include <string>

#include "fsmsg/frame_t.hpp"
#include "services/common/result.h"

namespace forgescan {

// An 8-bit grey PNG, without loss. frame: width times height bytes. Errors: kInvalidArgument.
Result<std::string> EncodePng(const fsmsg::frame_t& frame);

// left, right, or unknown.
std::string CameraName(int camera);

}  // namespace forgescan
