#include "tools/virtual_station/camera.h"

namespace forgescan {
namespace {

Eigen::Vector2d Distort(const std::array<double, 5>& d, const Eigen::Vector2d& n) {
  const double x = n.x();
  const double y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
  return {x * radial + 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x),
          y * radial + d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y};
}

}  // namespace

Eigen::Vector2d Project(const Lens& lens, const Eigen::Vector3d& p_in_camera) {
  const Eigen::Vector2d n = Distort(lens.distortion, p_in_camera.head<2>() / p_in_camera.z());
  return {lens.fx_px * n.x() + lens.cx_px, lens.fy_px * n.y() + lens.cy_px};
}

Eigen::Vector2d Unproject(const Lens& lens, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d wanted((pixel.x() - lens.cx_px) / lens.fx_px, (pixel.y() - lens.cy_px) / lens.fy_px);
  Eigen::Vector2d n = wanted;
  // Each round gains the ratio of distortion to one, about a factor of 20 for machine-vision lenses.
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector2d step = wanted - Distort(lens.distortion, n);
    n += step;
    if (step.squaredNorm() < 1e-26) {
      break;
    }
  }
  return n;
}

}  // namespace forgescan
