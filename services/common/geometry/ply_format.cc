#include "services/common/geometry/ply_format.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <sstream>
#include <utility>

namespace forgescan {
namespace {

std::vector<std::string> SplitWords(std::string_view line) {
  std::istringstream stream{std::string(line)};
  std::vector<std::string> words;
  for (std::string word; stream >> word;) {
    words.push_back(word);
  }
  return words;
}

Result<Encoding> ParseEncoding(const std::vector<std::string>& words, std::string_view name) {
  if (words.size() == 3 && words[2] == "1.0") {
    if (words[1] == "ascii") {
      return Encoding::kAscii;
    }
    if (words[1] == "binary_little_endian") {
      return Encoding::kLittleEndian;
    }
    if (words[1] == "binary_big_endian") {
      return Encoding::kBigEndian;
    }
  }
  return Fail(ErrorCode::kFormat,
              "{}: the format line is not ascii, binary_little_endian or binary_big_endian 1.0", name);
}

Result<PlyElement> ParseElement(const std::vector<std::string>& words, std::string_view name) {
  PlyElement element;
  if (words.size() == 3) {
    element.name = words[1];
    const char* last = words[2].data() + words[2].size();
    const auto [stop, failure] = std::from_chars(words[2].data(), last, element.count);
    if (failure == std::errc() && stop == last) {
      return element;
    }
  }
  return Fail(ErrorCode::kFormat, "{}: an element line of the header is not \"element NAME COUNT\"", name);
}

Result<PlyProperty> ParseProperty(const std::vector<std::string>& words, std::string_view name) {
  if (words.size() == 3) {
    ASSIGN_OR_RETURN(const ScalarType type, ParsePlyType(words[1], name));
    return PlyProperty{.name = words[2], .type = type};
  }
  if (words.size() == 5 && words[1] == "list") {
    ASSIGN_OR_RETURN(const ScalarType count_type, ParsePlyType(words[2], name));
    ASSIGN_OR_RETURN(const ScalarType type, ParsePlyType(words[3], name));
    return PlyProperty{.name = words[4], .type = type, .is_list = true, .count_type = count_type};
  }
  return Fail(ErrorCode::kFormat, "{}: a property line of the header is not \"property TYPE NAME\"", name);
}

Status AddHeaderLine(const std::vector<std::string>& words, std::string_view name, PlyHeader& header) {
  if (words.empty() || words[0] == "comment" || words[0] == "obj_info" || words[0] == "ply") {
    return {};
  }
  if (words[0] == "format") {
    ASSIGN_OR_RETURN(header.encoding, ParseEncoding(words, name));
    return {};
  }
  if (words[0] == "element") {
    ASSIGN_OR_RETURN(auto element, ParseElement(words, name));
    for (const PlyElement& known : header.elements) {
      if (known.name == element.name) {
        return Fail(ErrorCode::kFormat, "{}: the PLY header lists element {} twice", name, element.name);
      }
    }
    header.elements.push_back(std::move(element));
    return {};
  }
  if (words[0] == "property" && !header.elements.empty()) {
    ASSIGN_OR_RETURN(auto property, ParseProperty(words, name));
    const PlyElement& element = header.elements.back();
    if (element.Find(property.name) >= 0) {
      return Fail(ErrorCode::kFormat, "{}: element {} of the PLY header lists property {} twice", name,
                  element.name, property.name);
    }
    header.elements.back().properties.push_back(std::move(property));
    return {};
  }
  return Fail(ErrorCode::kFormat, "{}: the PLY header has an unknown line that begins with \"{}\"", name,
              words[0]);
}

}  // namespace

int PlyElement::Find(std::string_view property) const {
  const auto at = std::find_if(properties.begin(), properties.end(),
                               [property](const PlyProperty& p) { return p.name == property; });
  return at == properties.end() ? -1 : static_cast<int>(at - properties.begin());
}

Result<ScalarType> ParsePlyType(std::string_view word, std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, ScalarType>, 16> kTypes = {{
      {"char", ScalarType::kInt8},
      {"int8", ScalarType::kInt8},
      {"uchar", ScalarType::kUint8},
      {"uint8", ScalarType::kUint8},
      {"short", ScalarType::kInt16},
      {"int16", ScalarType::kInt16},
      {"ushort", ScalarType::kUint16},
      {"uint16", ScalarType::kUint16},
      {"int", ScalarType::kInt32},
      {"int32", ScalarType::kInt32},
      {"uint", ScalarType::kUint32},
      {"uint32", ScalarType::kUint32},
      {"float", ScalarType::kFloat32},
      {"float32", ScalarType::kFloat32},
      {"double", ScalarType::kFloat64},
      {"float64", ScalarType::kFloat64},
  }};
  for (const auto& [type_name, type] : kTypes) {
    if (word == type_name) {
      return type;
    }
  }
  return Fail(ErrorCode::kFormat, "{}: \"{}\" is not a PLY scalar type", name, word);
}

Result<PlyHeader> ParsePlyHeader(std::string_view bytes, std::string_view name) {
  PlyHeader header;
  std::size_t at = 0;
  bool has_format = false;
  while (at < bytes.size()) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string_view::npos) {
      break;
    }
    const auto words = SplitWords(bytes.substr(at, end - at));
    if (!words.empty() && words[0] == "comment") {
      const std::size_t text = bytes.find("comment", at) + std::string_view("comment ").size();
      header.comments.emplace_back(bytes.substr(std::min(text, end), end - std::min(text, end)));
    }
    at = end + 1;
    if (!words.empty() && words[0] == "end_header") {
      header.body_offset = at;
      return has_format ? Result<PlyHeader>(header)
                        : Fail(ErrorCode::kFormat, "{}: the PLY header has no format line", name);
    }
    has_format = has_format || (!words.empty() && words[0] == "format");
    RETURN_IF_ERROR(AddHeaderLine(words, name, header));
  }
  return Fail(ErrorCode::kFormat, "{}: the PLY header has no end_header line", name);
}

}  // namespace forgescan
