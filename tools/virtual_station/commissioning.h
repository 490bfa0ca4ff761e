// What the commissioning of the virtual station measured beside its geometry (teaching.h): contrasts of the
// pattern, noise of the cameras, expansion of the steel. Each is the truth plus seeded errors, as
// [commissioning_error] of the cell's file sizes them.
#pragma once

#include <string>
#include <vector>

#include "tools/virtual_station/cell_config.h"
#include "tools/virtual_station/pattern.h"

namespace forgescan {

// On a flat target. Shape: one ratio a frequency, in the order of projection.
struct MeasuredPattern {
  double reference_contrast;             // of the first frequency: white = mean + amplitude / contrast
  std::vector<double> modulation_ratio;  // amplitude over that of the first frequency, itself exactly 1
};
MeasuredPattern MeasurePattern(const CellConfig& config, ProjectedSet set);

// On a plain target. sigma^2 = read^2 + gain * grey value; rounding to whole grey values is part of `read`.
struct MeasuredNoise {
  double read_dn, gain_dn;
};
MeasuredNoise MeasureNoise(const CellConfig& config);

// In a dilatometer, above the steel's transformation. Units: degC, elongation against 20 degC.
struct MeasuredExpansion {
  std::vector<double> degc, elongation;
};
Result<MeasuredExpansion> MeasureExpansion(const CellConfig& config);

// The text of a station.toml with the measured keys put into its tables [reconstruction] and [fusion]; a key
// that the text gives stays as it is. Errors: kFormat, for text that is not TOML, has not these tables or
// states half of the expansion curve.
Result<std::string> CommissionedStation(const CellConfig& config, const std::string& station_text);

// What a station.toml states of its images ([camera] width_px, height_px, [trigger] frame_bytes) against
// those of the cell. Errors: kInvalidArgument, kFormat for text that is not TOML.
Status CheckImageSize(const CellConfig& config, const std::string& station_text);

}  // namespace forgescan
