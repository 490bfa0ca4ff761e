// Many registrations from random starts, and how they ended.
#pragma once

#include <vector>

#include "services/registration/icp.h"
#include "tools/forgescan/experiment/experiment.h"
#include "tools/forgescan/experiment/workpiece.h"

namespace forgescan {

inline constexpr double kStartShiftMm = 10, kStartTurnRad = 0.0524;  // 3 degrees

// One scan with its start: the start is the identity, the part lies elsewhere.
struct StartCase {
  Eigen::Isometry3d scan_from_model;
  PointCloud scan;
};
StartCase DrawStart(const Workpiece& workpiece, const ScanRequest& request);

constexpr double kRefused = -1;  // in place of a corner error

// Worst corner of the box, mm, or kRefused: one a run, in order of the runs. Same for any number of threads.
std::vector<double> RunOurs(const Workpiece& workpiece, const ScanRequest& request,
                            const ExperimentOptions& options);
// overlap_share: of the scan's points that it takes to be the part's.
std::vector<double> RunTrimmed(const Workpiece& workpiece, const ScanRequest& request, double overlap_share,
                               const ExperimentOptions& options);

struct Tally {
  int runs = 0, right = 0, near = 0, wrong = 0, refused = 0;
  double median_mm = 0, worst_mm = 0;  // over the accepted ones
};
// right: below right_mm; near: accepted below 1 mm; wrong: accepted beyond.
Tally Count(const std::vector<double>& corner_mm, double right_mm);

}  // namespace forgescan
