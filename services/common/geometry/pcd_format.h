// The header of a PCD file (Point Cloud Library, version 0.7).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/geometry/scalar_cursor.h"
#include "services/common/result.h"

namespace forgescan {

struct PcdField {
  std::string name;
  ScalarType type;
  std::size_t count = 1;  // scalars in this field
};

struct PcdHeader {
  Encoding encoding = Encoding::kAscii;
  std::vector<PcdField> fields;
  std::size_t points = 0;
  std::size_t body_offset = 0;
};

// Errors: kFormat; binary_compressed is refused by name.
Result<PcdHeader> ParsePcdHeader(std::string_view bytes, std::string_view name);

}  // namespace forgescan
