#include <array>

#include "tools/forgescan/experiment/experiment.h"

namespace forgescan {

std::span<const Experiment> Experiments() {
  static constexpr std::array kExperiments = {
      Experiment{"noise", "noise: phase noise against the Cramer-Rao bound", "draws a bin of phase", 40'000,
                 false, RunNoise},
      Experiment{"gamma", "gamma: both pattern sets before a projector that is not linear",
                 "steps from gamma 1.00 to 1.10", 10, false, RunGamma},
      Experiment{"clutter", "clutter: registration among foreign points", "random starts at each share", 200,
                 false, RunClutter},
      Experiment{"fig10", "fig10: our registration and the trimmed ICP, with clamp and platform",
                 "random starts of each part", 100, false, RunFig10},
      Experiment{"fig7", "fig7: reduced and full pattern set on the same scene", "levels of camera noise", 8,
                 true, RunFig7},
      Experiment{"balls", "balls: repeatability on a ceramic ball pair", "scans", 10, true, RunBalls},
      Experiment{"fig13-table1", "fig13-table1: eleven inspections of one axle", "inspections", 11, true,
                 RunTable1},
      Experiment{"fig15", "fig15: trend of a pilot lot while the die wears", "parts", 9, true, RunFig15},
  };
  return kExperiments;
}

}  // namespace forgescan
