#include "services/report/deviation_picture.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "services/report/splat_view.h"

namespace forgescan {
namespace {

constexpr double kMaxExtentMm = 100'000.0;
constexpr double kMinExtentMm = 1.0;
constexpr int kMarginPx = 36;
constexpr int kLabelPx = 44;        // height of a line of text
constexpr int kPadPx = 6;           // around the points of a view
constexpr int kBarPx = 34;          // height of the colour bar
const cv::Scalar kInk(66, 55, 47);  // BGR
const cv::Scalar kPaper(255, 255, 255);

// The corners of the scale, from -1 to 1 in equal steps.
constexpr std::array<Rgb, 7> kScaleColours = {{{18, 44, 105},
                                               {38, 98, 178},
                                               {130, 180, 222},
                                               {244, 243, 238},
                                               {245, 171, 125},
                                               {207, 74, 52},
                                               {112, 12, 30}}};

using Box = Eigen::AlignedBox3f;

Status Check(const DeviationCloud& cloud, const PictureOptions& options) {
  if (cloud.deviation_mm.size() != cloud.points.size() ||
      (!cloud.normals.empty() && cloud.normals.size() != cloud.points.size())) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "deviation picture: {} points have {} deviations and {} normals, one of each a point is needed",
        cloud.points.size(), cloud.deviation_mm.size(), cloud.normals.size());
  }
  if (!(options.scale_mm > 0.0) || !std::isfinite(options.scale_mm) || options.width_px < 400 ||
      options.width_px > 8000) {
    return Fail(
        ErrorCode::kInvalidArgument,
        "deviation picture: scale {} mm and width {} px, allowed are more than 0 mm and 400 to 8000 px",
        options.scale_mm, options.width_px);
  }
  return {};
}

Result<Box> Bounds(const DeviationCloud& cloud) {
  Box box;
  for (const auto& points : {cloud.points, cloud.model_points}) {
    for (const Eigen::Vector3f& point : points) {
      if (point.allFinite()) {
        box.extend(point);
      }
    }
  }
  if (box.isEmpty() || box.sizes().maxCoeff() > kMaxExtentMm) {
    return Fail(ErrorCode::kDegenerate, "deviation picture: the points have no extent between 0 and {} mm",
                kMaxExtentMm);
  }
  const Eigen::Vector3f grow = (Eigen::Vector3f::Constant(kMinExtentMm) - box.sizes()).cwiseMax(0.0F) * 0.5F;
  return Box(box.min() - grow, box.max() + grow);
}

// Places a look at the box with its upper left corner there.
PictureView Place(const Box& box, const Look& look, double px_per_mm, const cv::Point& corner) {
  const auto along = [&box](const Eigen::Vector3f& axis) {
    const double a = box.min().dot(axis);
    const double b = box.max().dot(axis);
    return std::pair(std::min(a, b), std::max(a, b));
  };
  const auto [min_u, max_u] = along(look.right);
  const auto [min_v, max_v] = along(look.up);
  PictureView view;
  view.left_px = corner.x;
  view.top_px = corner.y;
  view.px_per_mm = px_per_mm;
  view.width_px = static_cast<int>(std::ceil((max_u - min_u) * px_per_mm)) + 2 * kPadPx;
  view.height_px = static_cast<int>(std::ceil((max_v - min_v) * px_per_mm)) + 2 * kPadPx;
  view.min_u_mm = min_u - kPadPx / px_per_mm;
  view.max_v_mm = max_v + kPadPx / px_per_mm;
  return view;
}

const Look kFront = {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};
const Look kTop = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const Look kLeftEnd = {{0, -1, 0}, {0, 0, 1}, {-1, 0, 0}};
const Look kRightEnd = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};

DeviationPicture Layout(const Box& box, int width_px) {
  const Eigen::Vector3d size = box.sizes().cast<double>();
  const double inner_px = width_px - 2 * kMarginPx - 2 * kPadPx;
  const double long_scale = std::min(inner_px / size.x(), 0.6 * width_px / std::max(size.y(), size.z()));
  const double end_scale = std::min(0.2 * width_px / size.y(), 0.2 * width_px / size.z());
  DeviationPicture picture;
  picture.width_px = width_px;
  int row = kLabelPx;
  picture.front = Place(box, kFront, long_scale, {kMarginPx, row});
  row += picture.front.height_px + kLabelPx;
  picture.top = Place(box, kTop, long_scale, {kMarginPx, row});
  row += picture.top.height_px + kLabelPx;
  picture.left_end = Place(box, kLeftEnd, end_scale, {kMarginPx, row});
  picture.right_end =
      Place(box, kRightEnd, end_scale, {kMarginPx + picture.left_end.width_px + 2 * kMarginPx, row});
  picture.height_px = row + std::max(picture.left_end.height_px, 3 * kLabelPx + kBarPx) + kMarginPx / 2;
  return picture;
}

cv::Scalar Bgr(const Rgb& colour) { return {double(colour[2]), double(colour[1]), double(colour[0])}; }

void Write(cv::Mat& canvas, const std::string& text, const cv::Point& baseline) {
  cv::putText(canvas, text, baseline, cv::FONT_HERSHEY_DUPLEX, 0.68, kInk, 1, cv::LINE_AA);
}

void Centre(cv::Mat& canvas, const std::string& text, const cv::Point& baseline) {
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, 0.68, 1, nullptr);
  Write(canvas, text, {baseline.x - size.width / 2, baseline.y});
}

void Paste(cv::Mat& canvas, const ColourImage& image, const PictureView& at, const std::string& label) {
  for (int y = 0; y < image.height_px; ++y) {
    cv::Vec3b* row = canvas.ptr<cv::Vec3b>(at.top_px + y) + at.left_px;
    for (int x = 0; x < image.width_px; ++x) {
      const Rgb& colour = image.pixels[static_cast<std::size_t>(y * image.width_px + x)];
      row[x] = cv::Vec3b(colour[2], colour[1], colour[0]);
    }
  }
  Write(canvas, label, {at.left_px, at.top_px - 12});
}

// The colour bar with its ticks, right of the end views.
void DrawScale(cv::Mat& canvas, const DeviationPicture& picture, double scale_mm) {
  const int left = picture.right_end.left_px + picture.right_end.width_px + 3 * kMarginPx;
  const int width = picture.width_px - 2 * kMarginPx - left;
  const int top = picture.right_end.top_px + kLabelPx / 2;
  Write(canvas, "Deviation from the design model, mm", {left, top - 12});
  for (int x = 0; x < width; ++x) {
    const double deviation_mm = scale_mm * (2.0 * (x + 0.5) / width - 1.0);
    cv::line(canvas, {left + x, top}, {left + x, top + kBarPx}, Bgr(DeviationColour(deviation_mm, scale_mm)),
             1);
  }
  cv::rectangle(canvas, {left, top}, {left + width, top + kBarPx}, kInk, 1);
  constexpr int kTicks = 4;  // on either side of 0
  for (int tick = -kTicks; tick <= kTicks; ++tick) {
    const int x = left + width * (tick + kTicks) / (2 * kTicks);
    cv::line(canvas, {x, top + kBarPx}, {x, top + kBarPx + 8}, kInk, 1);
    Centre(canvas, fmt::format("{:+.2f}", scale_mm * tick / kTicks), {x, top + kBarPx + 32});
  }
  const int row = top + kBarPx + 32 + kLabelPx;
  Write(canvas, "blue: material missing, red: material in excess", {left, row});
  cv::rectangle(canvas, {left, row + 18}, {left + 30, row + 40}, Bgr(kNoDataColour), cv::FILLED);
  Write(canvas, "no data", {left + 44, row + 37});
}

}  // namespace

Rgb DeviationColour(double deviation_mm, double scale_mm) {
  constexpr int kSteps = static_cast<int>(kScaleColours.size()) - 1;
  const double at = (std::clamp(deviation_mm / scale_mm, -1.0, 1.0) + 1.0) * 0.5 * kSteps;
  const int below = std::min(static_cast<int>(at), kSteps - 1);
  const double share = at - below;
  Rgb colour;
  for (std::size_t i = 0; i < colour.size(); ++i) {
    const double a = kScaleColours[static_cast<std::size_t>(below)][i];
    const double b = kScaleColours[static_cast<std::size_t>(below) + 1][i];
    colour[i] = static_cast<std::uint8_t>(std::lround(a + share * (b - a)));
  }
  return colour;
}

Result<DeviationPicture> DrawDeviations(const DeviationCloud& cloud, const PictureOptions& options) {
  RETURN_IF_ERROR(Check(cloud, options));
  ASSIGN_OR_RETURN(const Box box, Bounds(cloud));
  DeviationPicture picture = Layout(box, options.width_px);
  cv::Mat canvas(picture.height_px, picture.width_px, CV_8UC3, kPaper);
  const auto draw = [&](const Look& look, const PictureView& view, const char* label) {
    Paste(canvas, SplatView(cloud, look, view, options.scale_mm), view, label);
  };
  draw(kFront, picture.front, "Front (x to the right, z up)");
  draw(kTop, picture.top, "Top (x to the right, y up)");
  draw(kLeftEnd, picture.left_end, "Left end (seen along +x)");
  draw(kRightEnd, picture.right_end, "Right end (seen along -x)");
  DrawScale(canvas, picture, options.scale_mm);
  if (!cv::imencode(".png", canvas, picture.png, {cv::IMWRITE_PNG_COMPRESSION, 6})) {
    return Fail(ErrorCode::kIo, "deviation picture: {} x {} pixels could not be encoded as PNG", canvas.cols,
                canvas.rows);
  }
  return picture;
}

}  // namespace forgescan
