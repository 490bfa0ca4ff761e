#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tools/virtual_station/scene.h"
#include "tools/virtual_station/station_writer.h"
#include "tools/virtual_station/teaching.h"
#include "tools/virtual_station/truth.h"

namespace forgescan {
namespace {

const std::string kCell = std::string(FORGESCAN_SOURCE_DIR) + "/stations/virtual/cell.toml";

CellConfig Config() {
  auto config = LoadCellConfig(kCell, 8);
  EXPECT_TRUE(config.ok());
  return *config;
}

TEST(Camera, UnprojectInvertsProject) {
  const Lens lens = Config().rig.left.lens;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(-0.5, -0.5), {305.5, 255.5}, {150.0, 10.0}}) {
    EXPECT_LT((Project(lens, Unproject(lens, pixel).homogeneous()) - pixel).norm(), 1e-9);  // px: rounding
  }
}

TEST(Teaching, PerfectCalibrationAndMarkersGiveTheTaughtPose) {
  CellConfig config = Config();
  config.robot.position_sd_mm = config.robot.rotation_sd_rad = config.robot.marker_sd_mm = 0.0;
  config.calibration_error = {};
  const Rig rig = CalibratedRig(config);
  const auto array_from_camera = TeachViews(config, rig);
  const Eigen::Isometry3d rig_from_left = rig.left.camera_from_rig.inverse();
  for (std::size_t i = 0; i < config.views.size(); ++i) {
    Eigen::Isometry3d left_from_rectified = Eigen::Isometry3d::Identity();
    left_from_rectified.linear() = Rectify(rig).rectified_from_left.transpose();
    const Eigen::Isometry3d expected =
        TaughtRigPose(config.views[i], config.working_distance_mm) * rig_from_left * left_from_rectified;
    EXPECT_LT((array_from_camera[i].matrix() - expected.matrix()).norm(), 1e-6);  // mm: rounding
  }
}

TEST(Teaching, ARigIsWhatItsCalibrationSays) {
  const CellConfig config = Config();
  const Rig calibrated = CalibratedRig(config);
  const StereoCalibration calibration = CalibrationOf(calibrated);
  EXPECT_TRUE(Check(calibration).ok());
  const Rig back = WithCalibration(config.rig, calibration);
  const Eigen::Vector3d p_in_rig(80, -60, config.working_distance_mm);
  for (const auto device : {&Rig::left, &Rig::right, &Rig::projector}) {
    const auto seen = [&](const Rig& rig) {
      return Project((rig.*device).lens, (rig.*device).camera_from_rig * p_in_rig);
    };
    EXPECT_LT((seen(back) - seen(calibrated)).norm(), 1e-9);  // px: rounding
    EXPECT_GT((seen(back) - seen(config.rig)).norm(), 1e-4);  // px: the calibration's errors
  }
}

TEST(Teaching, ViewMatricesAreAsGoodAsTheirMarkers) {
  const CellConfig config = Config();
  CellConfig perfect = config;
  perfect.robot.position_sd_mm = perfect.robot.rotation_sd_rad = perfect.robot.marker_sd_mm = 0.0;
  const Rig rig = CalibratedRig(config);
  const auto taught = TeachViews(config, rig);
  const auto ideal = TeachViews(perfect, rig);
  double worst_mm = 0.0;
  for (std::size_t i = 0; i < taught.size(); ++i) {
    const Eigen::Vector3d centre(120.0, 0.0, config.working_distance_mm);
    worst_mm = std::max(worst_mm, (taught[i] * centre - ideal[i] * centre).norm());
  }
  EXPECT_GT(worst_mm, 0.002);
  EXPECT_LT(worst_mm,
            0.08);  // mm: 3 sigma of 0.02 (markers), 0.016 (robot's rotation) and 0.009 (its position)
}

// Where the calibrated cameras see the point that the true ones see at `p_in_rig`.
Eigen::Vector3d Seen(const Rig& truth, const Rig& calibrated, const Eigen::Vector3d& p_in_rig) {
  const Rectification rectification = Rectify(calibrated);
  const auto ray = [&](const PinholeCamera& camera, const Lens& lens, const Eigen::Matrix3d& rectify) {
    const Eigen::Vector2d pixel = Project(camera.lens, camera.camera_from_rig * p_in_rig);
    return Eigen::Vector2d((rectify * Unproject(lens, pixel).homogeneous()).hnormalized());
  };
  const Eigen::Vector2d left = ray(truth.left, calibrated.left.lens, rectification.rectified_from_left);
  const Eigen::Vector2d right = ray(truth.right, calibrated.right.lens, rectification.rectified_from_right);
  const double depth_mm = rectification.baseline_mm / (left.x() - right.x());
  return calibrated.left.camera_from_rig.inverse() *
         (rectification.rectified_from_left.transpose() * (depth_mm * left.homogeneous()));
}

TEST(Teaching, ProjectorIsCalibratedByWhatTheCamerasSee) {
  CellConfig config = Config();
  for (config.seed = 1; config.seed <= 20; ++config.seed) {
    const Rig rig = CalibratedRig(config);
    for (const double x_mm : {-100.0, 0.0, 100.0}) {
      const Eigen::Vector3d p_in_rig(x_mm, 30.0, config.working_distance_mm);
      const Eigen::Vector2d true_px =
          Project(config.rig.projector.lens, config.rig.projector.camera_from_rig * p_in_rig);
      const Eigen::Vector2d seen_px =
          Project(rig.projector.lens, rig.projector.camera_from_rig * Seen(config.rig, rig, p_in_rig));
      EXPECT_NEAR(seen_px.x(), true_px.x(), 0.1)
          << config.seed;  // px: 0.15 px of focal length, 1/6 off the axis
    }
  }
}

TEST(Scene, WearMakesPlatesSmallerPartByPart) {
  PartConfig config = Config().part;
  config.plate_sd_mm = 0.0;
  const double first = ActualSize(config, 7, 0).left_plate_width_mm;
  EXPECT_NEAR(ActualSize(config, 7, 9).left_plate_width_mm, first + 9 * config.plate_wear_mm_per_part, 1e-9);
}

TEST(Scene, APostIsTurnedAboutItsOwnMiddle) {
  const SurfaceMesh mesh = BuildPostMesh({{{100, -200, -50}, 30, -250, 45}});
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  const double reach_mm = 15 * std::sqrt(2.0);  // of a corner
  EXPECT_LT((box.min() - Eigen::Vector3d(100 - reach_mm, -200 - reach_mm, -250)).norm(),
            1e-9);  // mm: rounding
  EXPECT_LT((box.max() - Eigen::Vector3d(100 + reach_mm, -200 + reach_mm, -50)).norm(), 1e-9);
}

TEST(Scene, AnOddPartHasItsOneSizeAndTheOthersOfItsTurn) {
  PartConfig config = Config().part;
  config.odd_parts.clear();
  const AxleSize even = ActualSize(config, 7, 3);
  config.odd_parts = {{.part = 3, .size_mm = &AxleSize::total_length_mm, .mm = 1886.0}};
  EXPECT_EQ(ActualSize(config, 7, 3).total_length_mm, 1886.0);
  EXPECT_EQ(ActualSize(config, 7, 3).left_plate_width_mm, even.left_plate_width_mm);
  EXPECT_NE(ActualSize(config, 7, 2).total_length_mm, 1886.0);
}

TEST(Station, WritesFilesAndTruth) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "virtual_station_test";
  const CellConfig config = Config();
  const Status written = WriteStation(config, ProjectedSet::kReduced, folder.string());
  ASSERT_TRUE(written.ok()) << written.error().message;
  for (const char* file : {"calibration/stereo.yaml", "pattern.toml", "views/views.toml", "model/axle.step",
                           "model/axle.stl", "model/features.toml"}) {
    EXPECT_TRUE(std::filesystem::is_regular_file(folder / file)) << file;
  }
  const VirtualCell cell(config, 1);
  const auto part = cell.Part(3);
  ASSERT_TRUE(part.ok());
  ASSERT_TRUE(WriteTruth(cell, *part, (folder / "truth.json").string()).ok());
  std::ifstream stream(folder / "truth.json");
  const auto truth = nlohmann::json::parse(stream);
  EXPECT_EQ(truth["dimensions"].size(), 5u);
  EXPECT_DOUBLE_EQ(truth["dimensions"]["total_length"], part->size.total_length_mm);
  EXPECT_EQ(truth["views"].size(), config.views.size());
  EXPECT_EQ(truth["verdict"], "OK");
  const auto odd = cell.Part(6);  // an odd_part of the file
  ASSERT_TRUE(odd.ok());
  ASSERT_TRUE(WriteTruth(cell, *odd, (folder / "odd.json").string()).ok());
  std::ifstream odd_stream(folder / "odd.json");
  const auto odd_truth = nlohmann::json::parse(odd_stream);
  EXPECT_EQ(odd_truth["verdict"], "NOT_OK");
  EXPECT_EQ(odd_truth["limits"]["total_length"]["verdict"], "NOT_OK");
  EXPECT_EQ(odd_truth["limits"]["left_plate_width"]["verdict"], "OK");
  EXPECT_FALSE(WriteTruth(cell, *part, "/nowhere/truth.json").ok());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace forgescan
