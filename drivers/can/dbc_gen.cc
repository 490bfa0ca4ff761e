// dbc_gen FILE.dbc DIRECTORY: writes station_frames.h, station_frames.cc and station.md into the directory.
#include <fmt/core.h>

#include <fstream>
#include <sstream>

#include "drivers/can/dbc.h"

namespace {

bool Write(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  return file.good();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: dbc_gen FILE.dbc DIRECTORY\n");
    return 2;
  }
  std::ifstream file(argv[1], std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  const auto dbc = forgescan::ParseDbc(text.str());
  if (!dbc.ok()) {
    fmt::print(stderr, "{}: {}\n", argv[1], dbc.error().message);
    return 1;
  }
  const std::string folder = std::string(argv[2]) + "/";
  const bool written = Write(folder + "station_frames.h", forgescan::WriteFramesHeader(*dbc)) &&
                       Write(folder + "station_frames.cc", forgescan::WriteFramesSource(*dbc)) &&
                       Write(folder + "station.md", forgescan::WriteFramesTable(*dbc));
  if (!written) {
    fmt::print(stderr, "cannot write into {}\n", argv[2]);
    return 1;
  }
}
