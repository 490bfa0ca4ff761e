#include "services/report/splat_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace forgescan {
namespace {

constexpr double kPointDiscMm = 0.9;  // radius: closes the gaps of a scan with about one point per mm^2
constexpr double kModelDiscMm = 1.8;  // radius: the model is sampled about every 2 mm
constexpr double kAmbient = 0.66;     // share of the colour that does not depend on the slope of the surface

struct Canvas {
  const PictureView& view;
  ColourImage image;
  std::vector<float> nearest;  // along `towards`, mm

  explicit Canvas(const PictureView& of)
      : view(of),
        image{of.width_px, of.height_px, {}},
        nearest(static_cast<std::size_t>(of.width_px) * static_cast<std::size_t>(of.height_px),
                -std::numeric_limits<float>::infinity()) {
    image.pixels.assign(nearest.size(), kPictureBackground);
  }
};

struct Disc {
  int radius_px;
  float depth_mm;
  Rgb colour;
};

int RadiusPx(double radius_mm, const PictureView& view) {
  return std::clamp(static_cast<int>(std::lround(radius_mm * view.px_per_mm)), 1, 12);
}

void Put(Canvas& canvas, const Eigen::Vector3f& p_in_model, const Look& look, const Disc& disc) {
  const PictureView& view = canvas.view;
  const auto column =
      static_cast<int>(std::floor((p_in_model.dot(look.right) - view.min_u_mm) * view.px_per_mm));
  const auto row = static_cast<int>(std::floor((view.max_v_mm - p_in_model.dot(look.up)) * view.px_per_mm));
  const int r = disc.radius_px;
  for (int y = std::max(0, row - r); y <= std::min(view.height_px - 1, row + r); ++y) {
    for (int x = std::max(0, column - r); x <= std::min(view.width_px - 1, column + r); ++x) {
      const int square = (x - column) * (x - column) + (y - row) * (y - row);
      const auto at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width_px) + static_cast<std::size_t>(x);
      if (square <= r * r && disc.depth_mm > canvas.nearest[at]) {
        canvas.nearest[at] = disc.depth_mm;
        canvas.image.pixels[at] = disc.colour;
      }
    }
  }
}

Rgb Shaded(const Rgb& colour, double facing) {
  const double light = kAmbient + (1.0 - kAmbient) * std::clamp(std::abs(facing), 0.0, 1.0);
  Rgb shaded;
  for (std::size_t i = 0; i < shaded.size(); ++i) {
    shaded[i] = static_cast<std::uint8_t>(std::lround(colour[i] * light));
  }
  return shaded;
}

}  // namespace

ColourImage SplatView(const DeviationCloud& cloud, const Look& look, const PictureView& view,
                      double scale_mm) {
  Canvas canvas(view);
  const int model_px = RadiusPx(kModelDiscMm, view);
  for (const Eigen::Vector3f& point : cloud.model_points) {
    if (point.allFinite()) {
      Put(canvas, point, look, {model_px, point.dot(look.towards) - kSurfaceSlackMm, kNoDataColour});
    }
  }
  const int point_px = RadiusPx(kPointDiscMm, view);
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].allFinite() || !std::isfinite(cloud.deviation_mm[i])) {
      continue;
    }
    const Rgb colour = DeviationColour(cloud.deviation_mm[i], scale_mm);
    const double facing = cloud.normals.empty() ? 1.0 : cloud.normals[i].dot(look.towards);
    Put(canvas, cloud.points[i], look,
        {point_px, cloud.points[i].dot(look.towards),
         std::isfinite(facing) ? Shaded(colour, facing) : colour});
  }
  return std::move(canvas.image);
}

}  // namespace forgescan
