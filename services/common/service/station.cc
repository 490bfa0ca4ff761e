#include "services/common/service/station.h"

#include <filesystem>

namespace forgescan {
Result<Station> Station::Load(const std::string& folder) {
  const std::filesystem::path base(folder);
  ASSIGN_OR_RETURN(ConfigFile file, ConfigFile::Load((base / "station.toml").string()));
  Station station;
  station.folder = folder;
  station.file = file;
  ConfigTable table = file.Table("station");
  table.Required("name", station.name);
  table.Required("bus", station.bus_url);
  table.Required("can", station.can_url);
  for (const auto& [key, path] : {std::pair<const char*, std::string*>{"calibration", &station.calibration},
                                  {"pattern", &station.pattern},
                                  {"views", &station.views},
                                  {"model", &station.model},
                                  {"features", &station.features},
                                  {"results", &station.results}}) {
    table.Required(key, *path);
    *path = (base / *path).lexically_normal().string();
  }
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(file.OnlyTables({"station", "trigger", "camera", "robot", "cooling", "reconstruction",
                                   "fusion", "registration", "report", "recorder", "supervision"}));
  return station;
}

}  // namespace forgescan
