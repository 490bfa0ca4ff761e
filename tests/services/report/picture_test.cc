// The colours at known places of the picture, its size, and wrong inputs.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "services/report/deviation_picture.h"
#include "tests/services/report/sample_report.h"

namespace forgescan {
namespace {

constexpr double kSpacingMm = 2.0;
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

struct Drawn {
  DeviationPicture picture;
  cv::Mat image;

  Rgb At(const PictureView& view, double u_mm, double v_mm) const {
    const int x = view.left_px + static_cast<int>((u_mm - view.min_u_mm) * view.px_per_mm);
    const int y = view.top_px + static_cast<int>((view.max_v_mm - v_mm) * view.px_per_mm);
    const auto pixel = image.at<cv::Vec3b>(y, x);
    return {pixel[2], pixel[1], pixel[0]};
  }
};

Drawn Draw(const DeviationCloud& cloud, const PictureOptions& options = {.width_px = 1000, .scale_mm = 1.0}) {
  Result<DeviationPicture> picture = DrawDeviations(cloud, options);
  EXPECT_TRUE(picture.ok());
  return {*picture, cv::imdecode(picture->png, cv::IMREAD_COLOR)};
}

TEST(DeviationColour, EndsMiddleAndClamp) {
  EXPECT_EQ(DeviationColour(-1.0, 1.0), DeviationColour(-7.0, 1.0));
  EXPECT_EQ(DeviationColour(1.0, 1.0), DeviationColour(7.0, 1.0));
  const Rgb missing = DeviationColour(-0.6, 1.0);
  const Rgb excess = DeviationColour(0.6, 1.0);
  EXPECT_GT(missing[2], missing[0]) << "blue";
  EXPECT_GT(excess[0], excess[2]) << "red";
  for (const auto channel : DeviationColour(0.0, 1.0)) {
    EXPECT_GE(channel, 235) << "near white";
  }
}

TEST(DeviationPicture, HasTheSizeAskedForAndFourSides) {
  const PointCloud cloud = SampleAxle(kSpacingMm);
  const auto deviations = SampleDeviations(cloud);
  const Drawn drawn = Draw({cloud.points, cloud.normals, deviations, {}});
  EXPECT_EQ(drawn.image.cols, 1000);
  EXPECT_EQ(drawn.image.rows, drawn.picture.height_px);
  for (const PictureView& view :
       {drawn.picture.front, drawn.picture.top, drawn.picture.left_end, drawn.picture.right_end}) {
    EXPECT_GT(view.width_px, 0);
    EXPECT_LE(view.left_px + view.width_px, drawn.image.cols);
    EXPECT_LE(view.top_px + view.height_px, drawn.image.rows);
  }
}

TEST(DeviationPicture, ColoursLieWhereTheDeviationsAre) {
  const PointCloud cloud = SampleAxle(kSpacingMm);
  const auto deviations = SampleDeviations(cloud);
  const Drawn drawn = Draw({cloud.points, {}, deviations, {}});
  const Rgb left = drawn.At(drawn.picture.front, -900.0, 0.0);
  const Rgb right = drawn.At(drawn.picture.top, 900.0, 0.0);
  EXPECT_GT(left[2], left[0] + 60) << "0.8 mm missing: blue";
  EXPECT_GT(right[0], right[2] + 60) << "0.8 mm in excess: red";
  EXPECT_EQ(drawn.At(drawn.picture.front, 0.0, 41.0), kPictureBackground) << "beside the part";
}

TEST(DeviationPicture, TheNearerSideHidesTheFartherOne) {
  const std::vector<Eigen::Vector3f> points = {{0, 0, -50}, {0, 0, 50}, {100, 40, 0}};
  const std::vector<float> deviations = {-1.0F, 1.0F, 0.0F};
  const Drawn drawn = Draw({points, {}, deviations, {}});
  EXPECT_EQ(drawn.At(drawn.picture.top, 0.0, 0.0), DeviationColour(1.0, 1.0));
}

TEST(DeviationPicture, GreyWhereThereAreNoData) {
  const PointCloud model = SampleAxle(kSpacingMm);
  const std::vector<Eigen::Vector3f> points = {{-900, -44, 0}, {900, kNanF, 0}};
  const std::vector<float> deviations = {1.0F, 1.0F};
  const Drawn drawn = Draw({points, {}, deviations, model.points});
  EXPECT_EQ(drawn.At(drawn.picture.front, 900.0, 0.0), kNoDataColour);
  EXPECT_EQ(drawn.At(drawn.picture.front, -900.0, 0.0), DeviationColour(1.0, 1.0));
}

TEST(DeviationPicture, EqualInputsGiveEqualBytes) {
  const PointCloud cloud = SampleAxle(4.0);
  const auto deviations = SampleDeviations(cloud);
  const DeviationCloud input{cloud.points, cloud.normals, deviations, {}};
  EXPECT_EQ(Draw(input).picture.png, Draw(input).picture.png);
}

TEST(DeviationPicture, WrongInputsAreErrors) {
  const std::vector<Eigen::Vector3f> points = {{0, 0, 0}, {1, 1, 1}};
  const std::vector<Eigen::Vector3f> nowhere = {{kNanF, 0, 0}};
  const std::vector<float> two = {0.0F, 0.0F};
  const std::vector<float> one = {0.0F};
  EXPECT_FALSE(DrawDeviations({points, {}, one, {}}, {}).ok());
  EXPECT_FALSE(DrawDeviations({points, nowhere, two, {}}, {}).ok());
  EXPECT_FALSE(DrawDeviations({points, {}, two, {}}, {.width_px = 1000, .scale_mm = 0.0}).ok());
  EXPECT_FALSE(DrawDeviations({points, {}, two, {}}, {.width_px = 100'000, .scale_mm = 1.0}).ok());
  EXPECT_EQ(DrawDeviations({nowhere, {}, one, {}}, {}).error().code, ErrorCode::kDegenerate);
  EXPECT_EQ(DrawDeviations({{}, {}, {}, {}}, {}).error().code, ErrorCode::kDegenerate);
  EXPECT_TRUE(DrawDeviations({points, {}, two, {}}, {}).ok()) << "still works after the errors";
}

}  // namespace
}  // namespace forgescan
