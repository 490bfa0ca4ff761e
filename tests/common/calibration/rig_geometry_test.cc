#include "services/common/calibration/rig_geometry.h"

#include <gtest/gtest.h>

#include "tests/common/calibration/bar_scene.h"

namespace forgescan {
namespace {

const std::vector<Eigen::Vector3d> kPoints = {{10, -90, 580}, {125, 0, 650}, {240, 110, 720}};

TEST(RigGeometry, FindsWhatItSees) {
  const RigGeometry rig(TrueRig());
  const std::vector<Eigen::Vector3d> found = rig.Triangulated(rig.Seen(kPoints));
  ASSERT_EQ(found.size(), kPoints.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT((found[i] - kPoints[i]).norm(), 1e-6);  // mm; the rays of lenses are good to 1e-10
  }
}

TEST(RigGeometry, TheLeftCameraSeesByItsOwnModel) {
  StereoCalibration calibration = TrueRig();
  calibration.left.distortion.assign(5, 0);
  const RigGeometry rig(calibration);
  const std::vector<Eigen::Vector3d> p_in_left = rig.LeftFromCamera(kPoints);
  const PixelPairs pixels = rig.Seen(kPoints);
  for (std::size_t i = 0; i < kPoints.size(); ++i) {
    const Eigen::Vector3d image = calibration.left.camera_matrix * p_in_left[i];
    EXPECT_LT((pixels.left[i] - image.head<2>() / image.z()).norm(), 1e-9);  // px
    EXPECT_LT((rig.CameraFromLeft(p_in_left[i]) - kPoints[i]).norm(), 1e-9);
  }
}

// The projector stands 100 of 250 mm from the left camera.
TEST(RigGeometry, RowsThatDisagreeAreSharedByTheProjectorsPlace) {
  const RigGeometry rig(TrueRig());
  EXPECT_NEAR(rig.left_share(), 0.4, 1e-9);
  PixelPairs pixels = rig.Seen(kPoints);
  for (Eigen::Vector2d& pixel : pixels.left) pixel.y() += 1;
  const double up_left = rig.Triangulated(pixels)[1].y();
  pixels = rig.Seen(kPoints);
  for (Eigen::Vector2d& pixel : pixels.right) pixel.y() += 1;
  const double up_right = rig.Triangulated(pixels)[1].y();
  EXPECT_NEAR(up_left / up_right, 0.4 / 0.6, 0.01);  // distortions of the two lenses
  StereoCalibration blind = TrueRig();
  blind.projector.reset();
  EXPECT_EQ(RigGeometry(blind).left_share(), 0.5);
}

}  // namespace
}  // namespace forgescan
