// A station's folder as a run of the virtual station has it, and programs of ours in the background: for
// tests that run real processes.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/run_command.h"

namespace forgescan::testing {

std::string ReadAll(const std::filesystem::path& path);

// Makes FOLDER/station, the small virtual station with these replacements (regular expression -> text) in its
// station.toml, beside the cell.toml it needs.
void WriteSmallStation(const std::filesystem::path& folder,
                       const std::map<std::string, std::string>& changes);

// A program of this build in the background, its output in a file. Killed when the object goes.
class Background {
 public:
  Background(const std::vector<std::string>& arguments, const std::filesystem::path& output);
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  std::string Text() const { return ReadAll(output_); }
  bool running();
  void Signal(int signal) const;
  // Its exit code; -1 if it has not ended within that time, or by a signal.
  int Wait(int patience_s);

 private:
  std::filesystem::path output_;
  pid_t pid_;
  int exit_code_ = -1;
};

// By FOLDER/station.pid; 0 = not running.
pid_t PidOfService(const std::filesystem::path& folder, const std::string& service);

}  // namespace forgescan::testing
