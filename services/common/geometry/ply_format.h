// The header of a PLY file, and its elements as tables of numbers.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/geometry/scalar_cursor.h"
#include "services/common/result.h"

namespace forgescan {

struct PlyProperty {
  std::string name;
  ScalarType type;
  bool is_list = false;
  ScalarType count_type = ScalarType::kUint8;  // lists only
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  // Position of a property, or -1.
  int Find(std::string_view property) const;
};

struct PlyHeader {
  Encoding encoding = Encoding::kAscii;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;  // without the word, in file order
  std::size_t body_offset = 0;  // byte where the first element begins
};

// Errors: kFormat with the header's line that is wrong.
Result<PlyHeader> ParsePlyHeader(std::string_view bytes, std::string_view name);

// "float32", "uchar", ... as PLY names them. Errors: kFormat.
Result<ScalarType> ParsePlyType(std::string_view word, std::string_view name);

}  // namespace forgescan
