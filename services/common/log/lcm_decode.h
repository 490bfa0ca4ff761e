// Decodes a message by its definition instead of generated code.
#pragma once

#include <nlohmann/json.hpp>

#include "services/common/log/lcm_type.h"

namespace forgescan {

// An object with the fields of the message in their order. Integers and strings as they are; a boolean is
// true or false; a number that is not finite is null, for JSON has none; an array of bytes is binary; an
// array of several dimensions is an array of arrays.
//
// As strict as Decode() of codec.h. Errors: kFormat (unknown type, truncated, trailing bytes, impossible
// sizes, more values than the message can hold). Memory: no array is begun that has more elements than the
// message has bytes left, and there are at most four values a byte and 10000 more; an array or struct is one.
Result<nlohmann::ordered_json> DecodeToJson(const LcmTypes& types, ByteView message);

}  // namespace forgescan
