#include "services/common/geometry/pcd_format.h"

#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

namespace forgescan {
namespace {

using Lines = std::map<std::string, std::vector<std::string>>;

std::optional<std::size_t> ParseCount(const std::string& word) {
  std::size_t value = 0;
  const char* last = word.data() + word.size();
  const auto [stop, failure] = std::from_chars(word.data(), last, value);
  return failure == std::errc() && stop == last ? std::optional(value) : std::nullopt;
}

std::optional<ScalarType> ParseType(const std::string& kind, const std::string& size) {
  static const std::map<std::string, ScalarType> kTypes = {
      {"I1", ScalarType::kInt8},    {"U1", ScalarType::kUint8},  {"I2", ScalarType::kInt16},
      {"U2", ScalarType::kUint16},  {"I4", ScalarType::kInt32},  {"U4", ScalarType::kUint32},
      {"F4", ScalarType::kFloat32}, {"F8", ScalarType::kFloat64}};
  const auto at = kTypes.find(kind + size);
  return at == kTypes.end() ? std::nullopt : std::optional(at->second);
}

Result<std::vector<PcdField>> ParseFields(Lines& lines, std::string_view name) {
  const auto& names = lines["FIELDS"];
  const auto& sizes = lines["SIZE"];
  const auto& kinds = lines["TYPE"];
  const auto counts = lines.contains("COUNT") ? lines["COUNT"] : std::vector<std::string>(names.size(), "1");
  if (names.empty() || sizes.size() != names.size() || kinds.size() != names.size() ||
      counts.size() != names.size()) {
    return Fail(ErrorCode::kFormat, "{}: FIELDS, SIZE, TYPE and COUNT of the PCD header differ in length",
                name);
  }
  std::vector<PcdField> fields;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto type = ParseType(kinds[i], sizes[i]);
    const auto count = ParseCount(counts[i]);
    constexpr std::size_t kMaxCount =
        4096;  // far above any descriptor; keeps a wrong header from asking for gigabytes
    if (!type || !count || *count < 1 || *count > kMaxCount) {
      return Fail(ErrorCode::kFormat,
                  "{}: field {} of the PCD header has TYPE {} SIZE {} COUNT {}, which is not supported", name,
                  names[i], kinds[i], sizes[i], counts[i]);
    }
    fields.push_back({names[i], *type, *count});
  }
  return fields;
}

Result<Encoding> ParseEncoding(const std::vector<std::string>& words, std::string_view name) {
  if (words.size() == 1 && words[0] == "ascii") {
    return Encoding::kAscii;
  }
  if (words.size() == 1 && words[0] == "binary") {
    return Encoding::kLittleEndian;
  }
  return Fail(ErrorCode::kFormat, "{}: DATA of the PCD header is {}; only ascii and binary are read", name,
              words.empty() ? "missing" : words[0]);
}

// WIDTH and HEIGHT may be missing (older files); what is there must agree with POINTS.
Status CheckGrid(const Lines& lines, std::size_t points, std::string_view name) {
  std::size_t product = 1;
  for (const char* key : {"WIDTH", "HEIGHT"}) {
    const auto line = lines.find(key);
    if (line == lines.end()) return {};
    const auto side = line->second.size() == 1 ? ParseCount(line->second[0]) : std::nullopt;
    if (!side || (*side > 0 && product > std::numeric_limits<std::size_t>::max() / *side)) {
      return Fail(ErrorCode::kFormat, "{}: {} of the PCD header is not one count", name, key);
    }
    product *= *side;
  }
  if (product == points) return {};
  return Fail(ErrorCode::kFormat, "{}: POINTS of the PCD header is {}, WIDTH times HEIGHT is {}", name,
              points, product);
}

}  // namespace

Result<PcdHeader> ParsePcdHeader(std::string_view bytes, std::string_view name) {
  Lines lines;
  PcdHeader header;
  for (std::size_t at = 0; at < bytes.size() && !lines.contains("DATA");) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    std::istringstream stream{std::string(bytes.substr(at, end - at))};
    at = std::min(end + 1, bytes.size());
    header.body_offset = at;
    std::string key;
    if (!(stream >> key) || key.starts_with('#')) {
      continue;
    }
    for (std::string word; stream >> word;) {
      lines[key].push_back(word);
    }
  }
  ASSIGN_OR_RETURN(header.encoding, ParseEncoding(lines["DATA"], name));
  ASSIGN_OR_RETURN(header.fields, ParseFields(lines, name));
  const auto points = lines["POINTS"].size() == 1 ? ParseCount(lines["POINTS"][0]) : std::nullopt;
  if (!points) {
    return Fail(ErrorCode::kFormat, "{}: the PCD header has no POINTS count", name);
  }
  header.points = *points;
  RETURN_IF_ERROR(CheckGrid(lines, header.points, name));
  return header;
}

}  // namespace forgescan
