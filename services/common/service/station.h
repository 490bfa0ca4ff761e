// A station's folder: station.toml and the files it names. Every service of a station reads the same one.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "services/common/config/config.h"

namespace forgescan {

// The services of every station, by the names in their SERVICE_STATE.
inline constexpr std::array<const char*, 10> kServiceNames = {
    "recorder",    "report",       "registration", "fusion",  "reconstruction",
    "camera_left", "camera_right", "cooling",      "trigger", "robot"};

struct Station {
  std::string folder;  // where station.toml is; relative paths in it start here
  std::string name;
  std::string bus_url;
  std::string can_url;
  std::string calibration;  // stereo.yaml
  std::string pattern;      // pattern.toml: the projected sequence
  std::string views;        // views.toml: the view matrices
  std::string model;        // model bundle
  std::string features;     // features.toml: dimensions and limits
  std::string standing;     // standing.ply: what stands still about the part; empty = none
  std::string results;      // folder for reports and history
  // Of this station only: a table [service.NAME] starts forgescan-NAME and holds its settings. Alphabetical.
  std::vector<std::string> more_services;
  ConfigFile file;  // the tables of the services

  // Reads [station] of FOLDER/station.toml; file members come out as paths that can be opened.
  // Errors: as ConfigFile; a table nobody knows, or a service whose name cannot be one, is an error too.
  static Result<Station> Load(const std::string& folder);
};

}  // namespace forgescan
