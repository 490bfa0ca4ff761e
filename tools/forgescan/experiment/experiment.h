// The experiments of forgescan experiment: each repeats one of the paper's, or tests one claim of its theory,
// with the truth known. Source: Han et al., Sensors 2018, 18(12), 4368.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

struct ExperimentOptions {
  std::uint64_t seed = 1;  // of everything that is drawn; the virtual cell's too
  int runs = 0;            // how often; what of, the experiment says. 0: as many as the record has
  int scale_divisor = 1;   // of the virtual cameras' images
  int threads = 2;         // the results do not depend on it
  std::string cell = "stations/virtual/cell.toml";
  std::string station = "stations/virtual";  // folder with the station.toml whose settings are used
};

struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  // as long as the header
};

// A figure that was asked for: value <= limit, or >= limit.
struct Goal {
  std::string what;
  double value = 0;
  double limit = 0;
  std::string unit;
  bool is_floor = false;  // the limit is the least allowed

  bool IsMet() const { return is_floor ? value >= limit : value <= limit; }
};

// What one experiment found. Everything in it follows from the options alone.
struct ExperimentReport {
  std::string question;  // one paragraph: what was done, and what the truth is
  std::vector<Table> tables;
  std::vector<Goal> goals;
  std::vector<std::string> remarks;  // one sentence each
  std::string svg;                   // the picture, 900 px wide
};

struct Experiment {
  const char* name;
  const char* title;
  const char* runs;  // what --runs counts
  int default_runs;
  bool uses_cell;  // renders images of the virtual cell
  Result<ExperimentReport> (*run)(const ExperimentOptions&);
};

// In the order of the page.
std::span<const Experiment> Experiments();

// Errors of all: kInvalidArgument for options outside their limits, and those of the steps they call.
Result<ExperimentReport> RunNoise(const ExperimentOptions& options);
Result<ExperimentReport> RunGamma(const ExperimentOptions& options);
Result<ExperimentReport> RunClutter(const ExperimentOptions& options);
Result<ExperimentReport> RunFig10(const ExperimentOptions& options);
Result<ExperimentReport> RunFig7(const ExperimentOptions& options);
Result<ExperimentReport> RunBalls(const ExperimentOptions& options);
Result<ExperimentReport> RunTable1(const ExperimentOptions& options);
Result<ExperimentReport> RunFig15(const ExperimentOptions& options);

}  // namespace forgescan
