// How a size answers to errors of the points it was measured from: what an uncertainty is made of.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace forgescan {

// Change of a size with a move of all points of one view. The view's middle is the mean of its points.
struct ViewInfluence {
  std::uint16_t view = 0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();    // mm per mm of shift along x, y, z of the model
  Eigen::Vector3d turn_mm = Eigen::Vector3d::Zero();  // mm per rad of turn about x, y, z through the middle
  double scale_mm = 0;                                // mm per unit of scale about the middle
  double stretch_mm = 0;                              // mm per unit of scale about the model's origin
};

// The expected largest of the errors of many readings, in standard deviations of one; 0: there is no choice.
struct Extreme {
  double scatter = 0;  // of single points: every reading has its own
  double patch = 0;    // of patches: neighbouring readings share it
};

struct Influence {
  std::vector<ViewInfluence> views;  // ascending
  double outward = 0;                // mm per mm by which every point lies too high over the surface
  double noise_mm = 0;  // standard uncertainty from errors of single points, of the size they scatter by
  double form_mm = 0;   // standard uncertainty from the form of what was not seen, or seen unevenly
  double patch = 0;     // mm per mm of error that a patch of one view shares, the patches being independent
  Extreme extreme;      // of the readings the size was chosen from
};

}  // namespace forgescan
