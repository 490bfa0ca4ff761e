#include "services/fusion/view_matrices.h"

#include "services/common/config/config.h"

namespace forgescan {
namespace {

constexpr double kMaxNumber = 1e5;     // mm: no cell is larger
constexpr double kRigidWithin = 1e-6;  // of R^T R - 1: what 10 printed digits leave

bool IsRigid(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool orthonormal =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm() < kRigidWithin;
  return orthonormal && rotation.determinant() > 0 && matrix.row(3) == Eigen::RowVector4d(0, 0, 0, 1);
}

}  // namespace

Result<ViewMatrices> ViewMatrices::Load(const std::string& path) {
  ASSIGN_OR_RETURN(const ConfigFile file, ConfigFile::Load(path));
  ConfigTable root = file.Root();
  ViewMatrices views;
  std::int64_t crc = 0;
  root.Required("path_crc32", crc, std::int64_t{0}, std::int64_t{0xffffffff});
  root.Required("recorded_body_degc", views.recorded_body_degc, -20.0, 100.0);
  views.path_crc32 = static_cast<std::uint32_t>(crc);
  for (ConfigTable& table : root.Tables("view")) {
    int index = -1;
    std::vector<double> numbers(16, 0.0);
    table.Required("index", index, 0, 999);
    table.Required("array_from_camera", numbers, 16, -kMaxNumber, kMaxNumber);
    const Eigen::Matrix4d matrix =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
    if (index != static_cast<int>(views.array_from_camera.size())) {
      table.Reject("index", "must count up from 0 in file order");
    } else if (!IsRigid(matrix)) {
      table.Reject("array_from_camera",
                   "is not a rigid transformation: rows of an orthonormal rotation, last row 0 0 0 1");
    }
    views.array_from_camera.emplace_back(matrix);
  }
  RETURN_IF_ERROR(root.Finish());
  if (views.array_from_camera.empty()) {
    return Fail(ErrorCode::kNotFound, "{}: has no [[view]]; at least one is required", path);
  }
  return views;
}

}  // namespace forgescan
