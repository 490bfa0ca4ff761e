#include "services/common/imaging/stereo_calibration_text.h"

#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>

namespace forgescan {
namespace {

void WriteLens(cv::FileStorage& file, const std::string& suffix, const CameraIntrinsics& lens) {
  cv::Mat matrix;
  cv::eigen2cv(lens.camera_matrix, matrix);
  file << "K" + suffix << matrix << "D" + suffix << cv::Mat(lens.distortion, true).reshape(1, 1);
}

void WritePose(cv::FileStorage& file, const std::string& suffix, const PoseFromLeft& pose) {
  cv::Mat rotation, translation;
  cv::eigen2cv(pose.rotation, rotation);
  cv::eigen2cv(pose.translation_mm, translation);
  file << "R" + suffix << rotation << "T" + suffix << translation;
}

}  // namespace

std::string StereoCalibrationText(const StereoCalibration& calibration) {
  cv::FileStorage file(".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  if (calibration.image_size) {
    file << "image_width" << calibration.image_size->width_px << "image_height"
         << calibration.image_size->height_px;
  }
  WriteLens(file, "l", calibration.left);
  WriteLens(file, "r", calibration.right);
  WritePose(file, "", calibration.right_from_left);
  if (calibration.projector) {
    WriteLens(file, "p", calibration.projector->intrinsics);
    WritePose(file, "p", calibration.projector->projector_from_left);
  }
  return file.releaseAndGetString();
}

}  // namespace forgescan
