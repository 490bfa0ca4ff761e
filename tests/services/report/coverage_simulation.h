// Parts measured again and again on paper: surfaces with known sizes, points of ten views with every error an
// uncertainty budget states, drawn anew for each part, and how often the stated interval holds the true size.
#pragma once

#include <string>
#include <vector>

#include "services/common/result.h"
#include "services/report/uncertainty.h"

namespace forgescan::testing {

struct CoverageOptions {
  int parts = 500;
  std::uint64_t seed = 1;
  unsigned threads = 0;  // 0: as many as the host has; the result does not depend on it
  UncertaintyBudget budget;
  std::size_t surface_points = 100'000;  // over the whole part, from which each view sees its share
  double noise_mm = 0.03;                // of single points
  double form_mm = 0.05;                 // of the forged faces, standard deviation
  // Correlation lengths of what is drawn, in those the evaluation assumes (InfluenceOptions).
  double patch_lengths = 1, form_lengths = 1;
};

// Of one dimension over all parts. Units: mm.
struct Coverage {
  std::string name;
  int parts = 0;                       // that have a value
  int held = 0;                        // whose interval [y - U, y + U] holds the true size
  double bias_mm = 0;                  // mean error
  double scatter_mm = 0;               // standard deviation of the error
  double stated_mm = 0;                // root mean square of U / 2
  std::vector<UncertaintyTerm> terms;  // of the last part

  double Share() const { return parts > 0 ? static_cast<double>(held) / parts : 0; }
};

// The true size is that of the same evaluation of an even, dense and exact cover of the whole face, form
// included (its least-squares size). Errors: those of the model and of the evaluation.
Result<std::vector<Coverage>> SimulateCoverage(const CoverageOptions& options);

// One line a dimension, and its contributions.
std::string CoverageTable(const std::vector<Coverage>& coverage);

}  // namespace forgescan::testing
