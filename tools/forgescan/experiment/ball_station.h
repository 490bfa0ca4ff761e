// The virtual station before the ball pair: commissioned, its calibration refined by a ball bar, its view
// taught again, and what stands about the pair scanned once without it.
#pragma once

#include <vector>

#include "tools/forgescan/experiment/bar_refinement.h"

namespace forgescan {

// One scan of the pair.
struct BallVisit {
  std::array<FittedBall, 2> before;  // with the calibration as commissioned; rectified left camera, mm
  std::array<FittedBall, 2> after;   // with the refined one
  BallPair taught;                   // the latter in the array frame by the taught view matrix
  BallPair by_standing;              // by the view matrix of this visit, from what stands still
  BallPair robot;                    // truth: where a perfect scanner on this robot would have seen them
  BallPair robot_at_rig;             // truth: the same, had the robot scattered about the scanner
};

class BallStation {
 public:
  static Result<BallStation> Create(const CellConfig& cell, const ExperimentOptions& options);

  const CellConfig& config() const { return cell_.config(); }
  const StereoCalibration& commissioned() const { return before_.files.calibration; }
  const BarRefinement& bar() const { return bar_; }

  // visit: 0, 1, ...; the robot comes anew each time.
  Result<BallVisit> Scan(int visit) const;

 private:
  // A station's files and the reconstruction they make.
  struct Scanner {
    StationFiles files;
    Reconstructor reconstructor;
  };
  BallStation(const CellConfig& config, int threads, Scanner before, Scanner after, BarRefinement bar);
  Status ScanStanding();

  VirtualCell cell_;
  Scanner before_, after_;
  BarRefinement bar_;
  std::vector<SurfaceCell> standing_;
  VisitErrorOptions visit_;
};

}  // namespace forgescan
