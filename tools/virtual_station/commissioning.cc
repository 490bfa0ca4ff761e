#include "tools/virtual_station/commissioning.h"

#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "services/common/config/toml_text.h"

namespace forgescan {
namespace {

// The table begins where EN 1993-1-2 ends the transformation: colder parts have no size here.
constexpr std::array kDilatometerDegc = {860.0, 900.0, 950.0, 1000.0, 1100.0, 1200.0};
constexpr double kRoundingVariance = 1.0 / 12.0;  // DN^2

// First harmonic and mean of a sinusoid as projected, fractions of white.
struct Sinusoid {
  double mean, amplitude;
};
Sinusoid Projected(const ProjectorLightConfig& light, double period_px) {
  const auto level = [&](double quarter) {
    return PatternLevel(light, {period_px, 0.0}, 0.25 * quarter * period_px);
  };
  return {0.25 * (level(0) + level(1) + level(2) + level(3)), 0.5 * (level(0) - level(2))};
}

using Keys = std::vector<std::pair<std::string, std::string>>;  // key, value

// The line behind "[table]", or none if there is no such line.
std::optional<std::size_t> BehindHeader(const std::string& text, const std::string& table) {
  const std::string header = "[" + table + "]";
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (text.compare(begin, header.size(), header) == 0) {
      return std::min(end + 1, text.size());
    }
    begin = end + 1;
  }
  return std::nullopt;
}

Error Broken(const toml::parse_error& error) {
  return Fail(ErrorCode::kFormat, "station.toml: line {}: {}", error.source().begin.line,
              error.description());
}

// The two lists of one curve: the station states both, or both are measured.
Status CheckExpansion(const std::string& text) {
  RETURN_IF_ERROR(CheckTomlText(text, "station.toml"));
  const toml::table root = toml::parse(text);
  const toml::node_view fusion = root["fusion"];
  if (!fusion["expansion_degc"] == !fusion["expansion"]) {
    return {};
  }
  return Fail(ErrorCode::kFormat,
              "station.toml: [fusion] states only one of expansion_degc and expansion; both or neither");
}

Status CheckSize(const toml::node_view<const toml::node>& stated, const char* key, std::int64_t rendered) {
  const auto value = stated.value_exact<std::int64_t>();
  if (!value.has_value() || *value == rendered) {
    return {};
  }
  return Fail(ErrorCode::kInvalidArgument, "station.toml: {} is {}, the cell's images make it {}", key,
              *value, rendered);
}

Result<std::string> WithKeys(std::string text, const std::string& name, const Keys& keys) {
  const toml::table root = toml::parse(text);
  const toml::table* table = root.get_as<toml::table>(name);
  const auto place = BehindHeader(text, name);
  if (table == nullptr || !place.has_value()) {
    return Fail(ErrorCode::kFormat, "station.toml: a line [{}] is missing", name);
  }
  std::string lines;
  for (const auto& [key, value] : keys) {
    if (!table->contains(key)) {
      lines += fmt::format("{} = {}  # measured at commissioning\n", key, value);
    }
  }
  return text.insert(*place, lines);
}

}  // namespace

MeasuredPattern MeasurePattern(const CellConfig& config, ProjectedSet set) {
  const ProjectorLightConfig& light = config.projector_light;
  RandomStream random(config.seed, RandomUse::kMeasuredPattern);
  const auto error = [&] { return 1.0 + config.commissioning_error.contrast_sd * random.Gaussian(); };
  const std::vector<Pattern> patterns = ProjectedPatterns(light, set);
  const Sinusoid first = Projected(light, patterns.front().period_px);
  const double white = PatternLevel(light, patterns.back(), 0.0);
  MeasuredPattern measured{.reference_contrast = first.amplitude / (white - first.mean) * error(),
                           .modulation_ratio = {1.0}};
  double last_period_px = patterns.front().period_px;
  for (const Pattern& pattern : patterns) {
    if (pattern.period_px != last_period_px && pattern.period_px != 0.0) {
      measured.modulation_ratio.push_back(Projected(light, pattern.period_px).amplitude / first.amplitude *
                                          error());
      last_period_px = pattern.period_px;
    }
  }
  return measured;
}

MeasuredNoise MeasureNoise(const CellConfig& config) {
  const SensorConfig& sensor = config.sensor;
  RandomStream random(config.seed, RandomUse::kMeasuredNoise);
  const double sd = config.commissioning_error.noise_sd;
  const double read_dn = std::sqrt(sensor.read_noise_dn * sensor.read_noise_dn + kRoundingVariance);
  const double measured_read_dn = read_dn * (1.0 + sd * random.Gaussian());
  return {measured_read_dn, sensor.gain_dn * (1.0 + sd * random.Gaussian())};
}

Result<MeasuredExpansion> MeasureExpansion(const CellConfig& config) {
  RandomStream random(config.seed, RandomUse::kMeasuredExpansion);
  const CommissioningErrorConfig& error = config.commissioning_error;
  const double factor = 1.0 + error.expansion_sd * random.Gaussian();
  MeasuredExpansion measured;
  for (const double degc : kDilatometerDegc) {
    ASSIGN_OR_RETURN(const double strain, ThermalStrain(degc));
    measured.degc.push_back(degc);
    measured.elongation.push_back(strain * factor + error.expansion_point_sd * random.Gaussian());
  }
  return measured;
}

Result<std::string> CommissionedStation(const CellConfig& config, const std::string& station_text) {
  const MeasuredNoise noise = MeasureNoise(config);
  ASSIGN_OR_RETURN(const MeasuredExpansion expansion, MeasureExpansion(config));
  try {
    RETURN_IF_ERROR(CheckExpansion(station_text));
    ASSIGN_OR_RETURN(std::string text, WithKeys(station_text, "reconstruction",
                                                {{"read_noise_dn", fmt::format("{:.4f}", noise.read_dn)},
                                                 {"gain_dn", fmt::format("{:.6f}", noise.gain_dn)}}));
    return WithKeys(std::move(text), "fusion",
                    {{"expansion_degc", fmt::format("[{:.1f}]", fmt::join(expansion.degc, ", "))},
                     {"expansion", fmt::format("[{:.6f}]", fmt::join(expansion.elongation, ", "))}});
  } catch (const toml::parse_error& error) {
    return Broken(error);
  }
}

Status CheckImageSize(const CellConfig& config, const std::string& station_text) {
  const std::int64_t width = config.rig.left.width_px, height = config.rig.left.height_px;
  try {
    const toml::table root = toml::parse(station_text);
    RETURN_IF_ERROR(CheckSize(root["camera"]["width_px"], "[camera] width_px", width));
    RETURN_IF_ERROR(CheckSize(root["camera"]["height_px"], "[camera] height_px", height));
    return CheckSize(root["trigger"]["frame_bytes"], "[trigger] frame_bytes", width * height);
  } catch (const toml::parse_error& error) {
    return Broken(error);
  }
}

}  // namespace forgescan
