// One side of the part as a picture: points as small discs, the nearest one wins.
#pragma once

#include "services/report/deviation_picture.h"

namespace forgescan {

// An orthographic look at the model frame. Columns run along `right`, rows against `up`; `towards` points at
// the viewer.
struct Look {
  Eigen::Vector3f right;
  Eigen::Vector3f up;
  Eigen::Vector3f towards;
};

struct ColourImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<Rgb> pixels;  // row-major
};

// Shape: view.width_px x view.height_px. Measured points lie in front of model points up to kSurfaceSlackMm
// behind them, so that missing material still shows, and a hole in the data shows the model, not the far
// side.
inline constexpr float kSurfaceSlackMm = 8.0F;
ColourImage SplatView(const DeviationCloud& cloud, const Look& look, const PictureView& view,
                      double scale_mm);

}  // namespace forgescan
