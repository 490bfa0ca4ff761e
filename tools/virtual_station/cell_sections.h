// Sections of the cell's file, one struct each. Errors of all: kFormat naming file, section, key and
// limits.
#pragma once

#include <string>
#include <vector>

#include "tools/virtual_station/cell_config.h"
#include "tools/virtual_station/toml_section.h"

namespace forgescan {

struct CellFile {
  const toml::table& root;
  std::string path;

  TomlSection Section(const std::string& name) const;
  // The tables of an array of tables, which must not be empty.
  Result<std::vector<const toml::table*>> Tables(const std::string& name) const;
};

// [part] and every [[odd_part]].
Result<PartConfig> ReadPart(const CellFile& file);
Result<HeatConfig> ReadHeat(const CellFile& file);
Result<RobotScatter> ReadRobot(const CellFile& file);
Result<CalibrationErrorConfig> ReadCalibrationError(const CellFile& file);
Result<CommissioningErrorConfig> ReadCommissioningError(const CellFile& file);
Result<ProjectorLightConfig> ReadProjectorLight(const CellFile& file);
Result<SensorConfig> ReadSensor(const CellFile& file);
Result<SurfaceConfig> ReadSurface(const CellFile& file);

}  // namespace forgescan
