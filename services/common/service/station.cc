#include "services/common/service/station.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

namespace forgescan {
namespace {

constexpr std::size_t kLongestName = 14;  // what fits into the table of the station

bool HasFormOfAName(std::string_view name) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz";
  constexpr std::string_view kAll = "abcdefghijklmnopqrstuvwxyz0123456789_";
  return name.size() <= kLongestName && name.find_first_of(kLetters) == 0 &&
         name.find_first_not_of(kAll) == std::string_view::npos;
}

// Names of programs, logs and units that a station has anyway.
bool IsTaken(std::string_view name) {
  constexpr std::array kOthers = {"camera", "inspect", "route", "station", "supervisor"};
  return std::ranges::find(kServiceNames, name) != kServiceNames.end() ||
         std::ranges::find(kOthers, name) != kOthers.end();
}

Result<std::vector<std::string>> LoadMoreServices(ConfigTable table) {
  std::vector<std::string> names = table.TableNames();
  for (const std::string& name : names) {
    if (IsTaken(name)) {
      table.Reject(name, "has a name that is taken");
    } else if (!HasFormOfAName(name)) {
      table.Reject(name, fmt::format("is no name of a service: a letter, then up to {} of a-z, 0-9 and _",
                                     kLongestName - 1));
    }
  }
  RETURN_IF_ERROR(table.Finish());
  return names;
}

}  // namespace

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
  if (table.Has("standing")) {
    table.Required("standing", station.standing);
    station.standing = (base / station.standing).lexically_normal().string();
  }
  RETURN_IF_ERROR(table.Finish());
  RETURN_IF_ERROR(
      file.OnlyTables({"station", "trigger", "camera", "robot", "cooling", "reconstruction", "fusion",
                       "registration", "report", "recorder", "supervision", "service"}));
  ASSIGN_OR_RETURN(station.more_services, LoadMoreServices(file.Table("service")));
  return station;
}

}  // namespace forgescan
