// Points of scenes with steps, holes and thin parts, against their true surface.
#include "services/reconstruction/stereo_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/core.hpp>
#include <string>

#include "tests/services/reconstruction/decoded_scene.h"
#include "tests/services/reconstruction/fringe_scene.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

struct Box {
  Eigen::Vector3d low, high;

  double Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
    double enter = 0, leave = 1e9;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double a = (low(i) - origin(i)) / direction(i), b = (high(i) - origin(i)) / direction(i);
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter < leave ? enter : -1;
  }
};

const Eigen::Vector3d kNormal = Eigen::Vector3d(0.15, -0.1, -1).normalized();

// A tilted plate and boxes before it.
DecodedScene Plate(std::vector<Box> boxes, double noise_px) {
  const auto hit = [boxes](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    double nearest = kNormal.dot(Eigen::Vector3d(0, 0, 430) - origin) / kNormal.dot(direction);
    for (const Box& box : boxes) {
      const double at = box.Hit(origin, direction);
      nearest = at > 0 && (nearest <= 0 || at < nearest) ? at : nearest;
    }
    return nearest;
  };
  DecodedScene scene;
  scene.hit = hit;
  scene.projector_width_px = 512;
  scene.noise_px = noise_px;
  return scene;
}

struct Views {
  DecodedView left, right;
};

Views See(const DecodedScene& scene) {
  const StereoCalibration rig = SmallRig();
  return {SeeDecoded(scene, rig.left, PoseFromLeft{}, rig, 1),
          SeeDecoded(scene, rig.right, rig.right_from_left, rig, 2)};
}

StereoRig Rig(bool with_projector) {
  StereoCalibration calibration = SmallRig();
  if (!with_projector) {
    calibration.projector.reset();
  }
  auto rig = MakeStereoRig(calibration, *calibration.image_size);
  EXPECT_TRUE(rig.ok());
  return std::move(rig).value();
}

Result<StereoPoints> RunViews(const Views& views, int threads = 1, StereoPoints recycled = {}) {
  ReconstructionConfig config;
  config.threads = threads;
  return ComputeStereoPoints(views.left, views.right, Rig(false), config, std::move(recycled));
}

struct Errors {
  long flying = 0;  // farther from the surface, along the ray, than 4 sigma + 0.05 mm
  double rms_in_sigma = 0;
  double mean_mm = 0;  // along the ray; > 0: behind the surface
};

Errors Against(const DecodedScene& scene, const PointCloud& cloud) {
  const Eigen::Matrix3d left_from_rectified = RectifiedFromLeft(SmallRig()).transpose();
  Errors errors;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = left_from_rectified * cloud.points[i].cast<double>();
    const double off = (1 - scene.hit(Eigen::Vector3d::Zero(), p)) * p.norm();
    const auto sigma = static_cast<double>(cloud.sigma_mm[i]);
    errors.flying += std::abs(off) > 4 * sigma + 0.05 ? 1 : 0;
    errors.rms_in_sigma += off * off / (sigma * sigma);
    errors.mean_mm += off / static_cast<double>(cloud.size());
  }
  errors.rms_in_sigma = std::sqrt(errors.rms_in_sigma / static_cast<double>(cloud.size()));
  return errors;
}

bool AreEqual(const PointCloud& a, const PointCloud& b) {
  const std::size_t bytes = a.size() * sizeof(Eigen::Vector3f);
  return a.size() == b.size() && std::memcmp(a.points.data(), b.points.data(), bytes) == 0 &&
         std::memcmp(a.normals.data(), b.normals.data(), bytes) == 0 && a.sigma_mm == b.sigma_mm;
}

TEST(StereoPoints, PredictTheirOwnNoiseOnAPlate) {
  const DecodedScene scene = Plate({}, 0.05);
  const auto points = RunViews(See(scene));
  ASSERT_TRUE(points.ok()) << points.error().message;
  EXPECT_GT(points->cloud_in_camera.size(), 30000U);
  EXPECT_NEAR(Against(scene, points->cloud_in_camera).rms_in_sigma, 1,
              0.03);  // 30,000 points, a few of them correlated
  EXPECT_LT(points->count.left_right + points->count.steep + points->count.no_normal,
            points->count.candidates / 20);
}

// What straight lines between pixels make of a curved surface, at pixels of 0.7 mm.
TEST(StereoPoints, ABallIsHardlyTooDeep) {
  DecodedScene scene = Plate({}, 0);
  scene.hit = [](const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    const Eigen::Vector3d from = origin - Eigen::Vector3d(5, -3, 430);
    const double a = direction.squaredNorm(), b = direction.dot(from), c = from.squaredNorm() - 45.0 * 45.0;
    return b * b - a * c > 0 ? (-b - std::sqrt(b * b - a * c)) / a : -1;
  };
  const auto points = RunViews(See(scene));
  ASSERT_TRUE(points.ok()) << points.error().message;
  EXPECT_GT(points->cloud_in_camera.size(), 4000U);
  const double mean_mm = Against(scene, points->cloud_in_camera).mean_mm;
  RecordProperty("mean_um", std::to_string(1000 * mean_mm));
  EXPECT_NEAR(mean_mm, 0, 0.008);
}

TEST(StereoPoints, StepsHolesAndThinPartsGiveNoFlyingPoints) {
  const std::vector<Box> boxes = {{{-60, -50, 380}, {-10, 10, 440}},  // a block
                                  {{30, -60, 395}, {34, 60, 399}},    // a post that floats before the plate
                                  {{-40, 35, 400}, {70, 37, 402}},    // a beam
                                  {{50, 45, 415}, {80, 70, 440}}};
  for (const double noise_px : {0.0, 0.02}) {
    DecodedScene scene = Plate(boxes, noise_px);
    scene.is_hole = [](const Eigen::Vector3d& p) {
      return Eigen::Vector2d(std::remainder(p.x(), 25.0), std::remainder(p.y(), 25.0)).norm() < 3;
    };
    const auto points = RunViews(See(scene));
    ASSERT_TRUE(points.ok()) << points.error().message;
    EXPECT_GT(points->cloud_in_camera.size(), 20000U);
    // 4 sigma of 30,000 normal values: two; beyond 0.05 mm more, none.
    EXPECT_EQ(Against(scene, points->cloud_in_camera).flying, 0);
    EXPECT_EQ(points->cloud_in_camera.size() +
                  static_cast<std::size_t>(points->count.no_normal + points->count.steep) +
                  static_cast<std::size_t>(points->count.depth_range + points->count.left_right) +
                  static_cast<std::size_t>(points->count.ambiguous + points->count.no_partner),
              static_cast<std::size_t>(points->count.candidates));
  }
}

TEST(StereoPoints, WrongFringeOrdersGiveNoFlyingPoints) {
  const DecodedScene scene = Plate({}, 0.02);
  Views views = See(scene);
  for (cv::Mat_<float>* map : {&views.left.coordinate_px, &views.right.coordinate_px}) {
    for (int i = 0; i < 400; ++i) {  // single pixels and small patches, off by a period
      cv::Mat_<float> patch = (*map)(cv::Rect(37 * i % 310, 53 * i % 230, 1 + i % 3, 1 + i % 2));
      patch += cv::Scalar(26);
    }
  }
  const auto points = RunViews(views);
  ASSERT_TRUE(points.ok()) << points.error().message;
  EXPECT_GT(points->cloud_in_camera.size(), 30000U);
  EXPECT_LE(Against(scene, points->cloud_in_camera).flying, 1);  // of 30,000 points and 800 patches
}

TEST(StereoPoints, AreTheSameForAnyThreadsAndMemory) {
  const Views views = See(Plate({{{-60, -50, 380}, {-10, 10, 440}}}, 0.03));
  auto one = RunViews(views, 1);
  ASSERT_TRUE(one.ok()) << one.error().message;
  for (const int threads : {2, 3, 7, 240, 1000}) {
    auto other = RunViews(views, threads);
    ASSERT_TRUE(other.ok());
    EXPECT_TRUE(AreEqual(one->cloud_in_camera, other->cloud_in_camera)) << threads;
    EXPECT_EQ(one->sample.size(), other->sample.size());
    EXPECT_EQ(one->count.no_partner, other->count.no_partner);
    const auto again = RunViews(views, 2, std::move(other).value());
    ASSERT_TRUE(again.ok());
    EXPECT_TRUE(AreEqual(one->cloud_in_camera, again->cloud_in_camera));
  }
}

TEST(StereoPoints, FringesThatRunTheOtherWayGiveTheSamePoints) {
  const Views views = See(Plate({}, 0.02));
  Views reversed = views;
  reversed.left.coordinate_px = cv::Mat_<float>(512 - views.left.coordinate_px);
  reversed.right.coordinate_px = cv::Mat_<float>(512 - views.right.coordinate_px);
  const auto a = RunViews(views), b = RunViews(reversed);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_NEAR(static_cast<double>(a->cloud_in_camera.size()), static_cast<double>(b->cloud_in_camera.size()),
              50);
  const auto mean = [](const std::vector<LitPoint>& sample) {
    double sum = 0;
    for (const LitPoint& point : sample) {
      sum += static_cast<double>(point.coordinate_px);
    }
    return sum / static_cast<double>(sample.size());
  };
  EXPECT_NEAR(mean(b->sample), 512 - mean(a->sample), 1);  // of nearly, not exactly the same points
}

TEST(StereoPoints, LeaveOutWhatIsNoNumber) {
  const DecodedScene scene = Plate({}, 0.02);
  Views views = See(scene);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (int i = 0; i < 300; ++i) {
    views.left.coordinate_px(7 * i % 240, 31 * i % 320) = std::numeric_limits<float>::quiet_NaN();
    views.right.coordinate_px(11 * i % 240, 29 * i % 320) = i % 2 == 0 ? kInfinity : -kInfinity;
  }
  const auto points = RunViews(views);
  ASSERT_TRUE(points.ok()) << points.error().message;
  EXPECT_GT(points->cloud_in_camera.size(), 30000U);
  EXPECT_EQ(Against(scene, points->cloud_in_camera).flying, 0);
  for (const Eigen::Vector3f& normal : points->cloud_in_camera.normals) {
    ASSERT_NEAR(normal.norm(), 1, 1e-5);
  }
}

TEST(StereoPoints, RefuseViewsThatAreNone) {
  const Views good = See(Plate({}, 0.02));
  Views dark = good;
  dark.right.coordinate_px =
      cv::Mat_<float>(good.right.cause.size(), std::numeric_limits<float>::quiet_NaN());
  EXPECT_THAT(RunViews(dark).error().message, HasSubstr("the right view changes by 0.0000 px"));
  Views against = good;
  against.right.coordinate_px = cv::Mat_<float>(512 - good.right.coordinate_px);
  EXPECT_EQ(RunViews(against).error().code, ErrorCode::kDegenerate);
  Views small = good;
  small.left.cause = good.left.cause.rowRange(0, 100);
  EXPECT_EQ(RunViews(small).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(RunViews(good).ok());
}

TEST(StereoPoints, OnesTheProjectorCouldNotLightAreLeftOut) {
  Views views = See(Plate({}, 0.02));
  ReconstructionConfig config;
  const auto all = ComputeStereoPoints(views.left, views.right, Rig(true), config);
  ASSERT_TRUE(all.ok()) << all.error().message;
  EXPECT_EQ(all->count.projector, 0);
  EXPECT_NEAR(all->median_projector_residual_px.value(), 0, 0.002);  // px; 30,000 residuals of 0.02
  for (cv::Mat_<float>* map : {&views.left.coordinate_px, &views.right.coordinate_px}) {
    (*map)(cv::Rect(0, 0, 320, 80)) +=
        cv::Scalar(5);  // both cameras agree, on a column that was not projected there
  }
  const auto some = ComputeStereoPoints(views.left, views.right, Rig(true), config);
  ASSERT_TRUE(some.ok()) << some.error().message;
  EXPECT_GT(some->count.projector, 5000);
}

}  // namespace
}  // namespace forgescan
