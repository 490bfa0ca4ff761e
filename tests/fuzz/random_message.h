// An encoded message of any type, made from the type's definition.
#pragma once

#include <cstdint>

#include "services/common/log/lcm_type.h"

namespace forgescan::fuzz {

// Counts of 0 to 3, short texts, any numbers. type: one of types.structs().
Bytes RandomMessage(const LcmTypes& types, const LcmStruct& type, std::uint64_t seed);

}  // namespace forgescan::fuzz
