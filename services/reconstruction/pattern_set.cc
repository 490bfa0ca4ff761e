#include "services/reconstruction/pattern_set.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <set>
#include <utility>

#include "services/common/config/toml_text.h"
#include "services/common/input_file.h"

namespace forgescan {
namespace {

Status CheckKeys(const toml::table& table, std::initializer_list<std::string_view> allowed,
                 const std::string& where) {
  for (const auto& [key, value] : table) {
    if (std::find(allowed.begin(), allowed.end(), key.str()) == allowed.end()) {
      return Fail(ErrorCode::kFormat, "{}: the key {} is unknown", where, key.str());
    }
  }
  return {};
}

template <typename T>
Result<T> Read(const toml::table& table, std::string_view key, const std::string& where) {
  const auto value = table[key].value<T>();
  if (!value) {
    return Fail(ErrorCode::kFormat, "{}: the key {} is missing or of the wrong type", where, key);
  }
  return *value;
}

// Of another number toml++ would make a whole one by a cast that is undefined for large ones.
template <>
Result<int> Read<int>(const toml::table& table, std::string_view key, const std::string& where) {
  const auto value = table[key].value_exact<std::int64_t>();
  if (!value || !std::in_range<int>(*value)) {
    return Fail(ErrorCode::kFormat, "{}: the key {} is missing or not a whole number", where, key);
  }
  return static_cast<int>(*value);
}

Result<double> ReadOr(const toml::table& table, std::string_view key, double otherwise,
                      const std::string& where) {
  return table.contains(key) ? Read<double>(table, key, where) : otherwise;
}

template <typename T>
Result<std::vector<T>> ReadList(const toml::table& table, std::string_view key, const std::string& where) {
  const toml::array* array = table[key].as_array();
  if (array == nullptr) {
    return Fail(ErrorCode::kFormat, "{}: the key {} is missing or not a list", where, key);
  }
  std::vector<T> values;
  for (const auto& node : *array) {
    const auto value = node.value<T>();
    if (!value) {
      return Fail(ErrorCode::kFormat, "{}: entry {} of {} is of the wrong type", where, values.size() + 1,
                  key);
    }
    values.push_back(*value);
  }
  return values;
}

Status ReadFrequency(const toml::table& table, const std::string& where, PatternSet& pattern) {
  RETURN_IF_ERROR(CheckKeys(table, {"period_px", "frames", "shifts_deg", "modulation_ratio"}, where));
  FringeFrequency frequency;
  ASSIGN_OR_RETURN(frequency.period_px, Read<double>(table, "period_px", where));
  ASSIGN_OR_RETURN(frequency.modulation_ratio, ReadOr(table, "modulation_ratio", 1.0, where));
  ASSIGN_OR_RETURN(const auto frames, ReadList<std::string>(table, "frames", where));
  ASSIGN_OR_RETURN(const auto shifts_deg, ReadList<double>(table, "shifts_deg", where));
  for (const auto& frame : frames) {
    frequency.frame_index.push_back(pattern.frame_count());
    pattern.frame_names.push_back(frame);
  }
  for (const double shift_deg : shifts_deg) {
    frequency.shift_rad.push_back(shift_deg * std::numbers::pi / 180);
  }
  pattern.frequencies.push_back(std::move(frequency));
  return {};
}

Status ReadFrequencies(const toml::table& table, const std::string& name, PatternSet& pattern) {
  const toml::array* list = table["frequency"].as_array();
  if (list == nullptr || !list->is_array_of_tables()) {
    return Fail(ErrorCode::kFormat, "{}: there is no [[frequency]]", name);
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string where = fmt::format("{}: frequency {}", name, i + 1);
    RETURN_IF_ERROR(ReadFrequency(*list->get(i)->as_table(), where, pattern));
  }
  return {};
}

Status ReadReference(const toml::table& table, const std::string& name, PatternSet& pattern) {
  ASSIGN_OR_RETURN(auto reference, Read<std::string>(table, "reference", name));
  pattern.reference_frame_index = pattern.frame_count();
  pattern.frame_names.push_back(std::move(reference));
  if (!table.contains("reference_light")) {
    return {};
  }
  ASSIGN_OR_RETURN(const auto light, Read<std::string>(table, "reference_light", name));
  if (light != "white" && light != "mid_grey") {
    return Fail(ErrorCode::kFormat, "{}: reference_light is \"{}\", allowed are \"white\" and \"mid_grey\"",
                name, light);
  }
  pattern.reference_light = light == "white" ? ReferenceLight::kWhite : ReferenceLight::kMidGrey;
  return {};
}

Result<PatternSet> ReadPatternSet(const toml::table& table, const std::string& name) {
  RETURN_IF_ERROR(CheckKeys(table,
                            {"projector_width_px", "phase_origin_px", "background", "reference",
                             "reference_light", "reference_contrast", "frequency"},
                            name));
  PatternSet pattern;
  ASSIGN_OR_RETURN(pattern.projector_width_px, Read<int>(table, "projector_width_px", name));
  ASSIGN_OR_RETURN(pattern.phase_origin_px, ReadOr(table, "phase_origin_px", 0.0, name));
  ASSIGN_OR_RETURN(pattern.reference_contrast, ReadOr(table, "reference_contrast", 1.0, name));
  ASSIGN_OR_RETURN(const auto background, Read<std::string>(table, "background", name));
  if (background != "own" && background != "shared") {
    return Fail(ErrorCode::kFormat, "{}: background is \"{}\", allowed are \"own\" and \"shared\"", name,
                background);
  }
  pattern.background = background == "own" ? Background::kOwn : Background::kShared;
  RETURN_IF_ERROR(ReadFrequencies(table, name, pattern));
  if (table.contains("reference") || table.contains("reference_light")) {
    RETURN_IF_ERROR(ReadReference(table, name, pattern));
  }
  return pattern;
}

Status CheckFrequency(const FringeFrequency& frequency, std::size_t number, const PatternSet& pattern) {
  constexpr double kMinPeriodPx = 4;  // fewer columns than that do not make a sine
  if (!(frequency.period_px >= kMinPeriodPx && frequency.period_px <= 2.0 * pattern.projector_width_px)) {
    return Fail(ErrorCode::kInvalidArgument, "frequency {}: period_px is {}, allowed {}..{}", number,
                frequency.period_px, kMinPeriodPx, 2 * pattern.projector_width_px);
  }
  if (!(frequency.modulation_ratio > 0 && frequency.modulation_ratio < 100)) {
    return Fail(ErrorCode::kInvalidArgument,
                "frequency {}: modulation_ratio is {}, allowed above 0 and below 100", number,
                frequency.modulation_ratio);
  }
  const std::size_t frames = frequency.frame_index.size();
  const std::size_t needed = pattern.background == Background::kOwn ? 3 : 2;
  if (frames < needed) {
    return Fail(ErrorCode::kInvalidArgument,
                "frequency {}: it has {} frames, a background of its kind needs {} or more", number, frames,
                needed);
  }
  if (frequency.shift_rad.size() != frames) {
    return Fail(ErrorCode::kInvalidArgument, "frequency {}: it has {} frames but {} shifts_deg", number,
                frames, frequency.shift_rad.size());
  }
  for (const double shift_rad : frequency.shift_rad) {
    if (!(std::abs(shift_rad) <= 4 * std::numbers::pi)) {
      return Fail(ErrorCode::kInvalidArgument, "frequency {}: a shift is {} rad, allowed -4 pi..4 pi", number,
                  shift_rad);
    }
  }
  return {};
}

Status CheckFrames(const PatternSet& pattern) {
  std::vector<int> used =
      pattern.reference_frame_index ? std::vector<int>{*pattern.reference_frame_index} : std::vector<int>{};
  for (const auto& frequency : pattern.frequencies) {
    used.insert(used.end(), frequency.frame_index.begin(), frequency.frame_index.end());
  }
  const std::set<int> different(used.begin(), used.end());
  const std::set<std::string> names(pattern.frame_names.begin(), pattern.frame_names.end());
  const bool each_once = different.size() == used.size() &&
                         static_cast<int>(used.size()) == pattern.frame_count() && *different.begin() == 0 &&
                         *different.rbegin() == pattern.frame_count() - 1;
  if (!each_once || names.size() != pattern.frame_names.size()) {
    return Fail(ErrorCode::kInvalidArgument,
                "the pattern set uses {} frames of {}; each must be used exactly once",
                std::min(different.size(), names.size()), pattern.frame_count());
  }
  return {};
}

}  // namespace

Status Check(const PatternSet& pattern) {
  constexpr int kMaxWidthPx = 16384;
  if (pattern.projector_width_px < 16 || pattern.projector_width_px > kMaxWidthPx) {
    return Fail(ErrorCode::kInvalidArgument, "projector_width_px is {}, allowed 16..{}",
                pattern.projector_width_px, kMaxWidthPx);
  }
  if (!(std::abs(pattern.phase_origin_px) <= kMaxWidthPx)) {
    return Fail(ErrorCode::kInvalidArgument, "phase_origin_px is {}, allowed -{}..{}",
                pattern.phase_origin_px, kMaxWidthPx, kMaxWidthPx);
  }
  if (!(pattern.reference_contrast > 0 && pattern.reference_contrast <= 1)) {
    return Fail(ErrorCode::kInvalidArgument, "reference_contrast is {}, allowed above 0 up to 1",
                pattern.reference_contrast);
  }
  if (pattern.frequencies.size() < 2 || pattern.frequencies.size() > 3) {
    return Fail(ErrorCode::kInvalidArgument, "the pattern set has {} frequencies, allowed 2 or 3",
                pattern.frequencies.size());
  }
  for (std::size_t i = 0; i < pattern.frequencies.size(); ++i) {
    RETURN_IF_ERROR(CheckFrequency(pattern.frequencies[i], i + 1, pattern));
  }
  return CheckFrames(pattern);
}

Result<PatternSet> ParsePatternSet(std::string_view toml_text, const std::string& name) {
  RETURN_IF_ERROR(CheckTomlText(toml_text, name));
  try {
    ASSIGN_OR_RETURN(auto pattern, ReadPatternSet(toml::parse(toml_text), name));
    if (const Status status = Check(pattern); !status.ok()) {
      return Fail(status.error().code, "{}: {}", name, status.error().message);
    }
    return pattern;
  } catch (const toml::parse_error& error) {
    return Fail(ErrorCode::kFormat, "{}: line {}: {}", name, error.source().begin.line, error.description());
  }
}

Result<PatternSet> LoadPatternSet(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(path));
  return ParsePatternSet(text, path.string());
}

}  // namespace forgescan
