#include "tools/forgescan/text_output.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include "services/common/input_file.h"

namespace forgescan {
namespace {

constexpr double kRigidTolerance = 1e-3;  // of the rotation part; hand-written poses carry 5 digits

}  // namespace

std::string PoseText(const Eigen::Isometry3d& pose) {
  std::string text;
  for (int row = 0; row < 4; ++row) {
    const Eigen::RowVector4d r = pose.matrix().row(row);
    text += fmt::format("{:.12g} {:.12g} {:.12g} {:.12g}\n", r[0], r[1], r[2], r[3]);
  }
  return text;
}

Result<Eigen::Isometry3d> ReadPose(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(std::string text, ReadInputFile(path));
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) {
    if (!(stream >> matrix(i / 4, i % 4))) {
      return Fail(ErrorCode::kFormat, "{}: number {} of the 16 of a 4 x 4 pose is missing", path.string(),
                  i + 1);
    }
  }
  std::string more;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool rigid = matrix.allFinite() && matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
                     rotation.determinant() > 0 &&
                     (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < kRigidTolerance;
  if (!rigid || stream >> more) {
    return Fail(ErrorCode::kFormat,
                "{}: not a rigid 4 x 4 pose (rotation orthonormal to {}, last row 0 0 0 1)", path.string(),
                kRigidTolerance);
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

}  // namespace forgescan
