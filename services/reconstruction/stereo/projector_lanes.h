// The projector column that lights a point. See kernel.h.
#pragma once

#include "services/reconstruction/stereo/kernel.h"
#include "services/reconstruction/stereo/lanes.h"

namespace forgescan {
namespace {

struct ImagePoint {
  Floats x, y;
};

// OpenCV's lens model without the tilt.
FORGESCAN_INLINE ImagePoint Distorted(Floats x, Floats y, const float* k) {
  const Floats s = x * x + y * y;
  const Floats radial = (1 + s * (k[0] + s * (k[1] + s * k[4]))) / (1 + s * (k[5] + s * (k[6] + s * k[7])));
  return {x * radial + 2 * k[2] * x * y + k[3] * (s + 2 * x * x) + s * (k[8] + s * k[9]),
          y * radial + k[2] * (s + 2 * y * y) + 2 * k[3] * x * y + s * (k[10] + s * k[11])};
}

FORGESCAN_INLINE Floats ProjectorColumn(const ProjectorModel& model, Floats x, Floats y, Floats z) {
  const float* const r = model.rotation;
  const float* const t = model.translation_mm;
  const Floats depth = r[6] * x + r[7] * y + r[8] * z + t[2];
  const ImagePoint image = Distorted((r[0] * x + r[1] * y + r[2] * z + t[0]) / depth,
                                     (r[3] * x + r[4] * y + r[5] * z + t[1]) / depth, model.distortion);
  const float* const tilt = model.tilt;
  const Floats column = tilt[0] * image.x + tilt[1] * image.y + tilt[2];
  const Floats scale = tilt[6] * image.x + tilt[7] * image.y + tilt[8];
  return model.focal_px * (column / scale) + model.center_px;
}

}  // namespace
}  // namespace forgescan
