#include "services/registration/registration_config.h"

namespace forgescan {
namespace {

constexpr double kRigidWithin = 1e-6;  // of R^T R - 1

bool IsRigid(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d rotation = pose.linear();
  return (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm() < kRigidWithin &&
         rotation.determinant() > 0 && pose.matrix().row(3) == Eigen::RowVector4d(0, 0, 0, 1);
}

}  // namespace

Result<RegistrationConfig> RegistrationConfig::Load(ConfigTable table) {
  RegistrationConfig config;
  IcpOptions& icp = config.icp;
  int threads = 0;
  if (table.Has("model_from_array")) {
    std::vector<double> numbers(16, 0.0);
    table.Required("model_from_array", numbers, 16, -1e5, 1e5);
    config.model_from_array.matrix() =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
    if (!IsRigid(config.model_from_array)) {
      table.Reject("model_from_array", "is not a rigid transformation");
    }
  }
  table.Optional("start_translation_mm", icp.start_translation_mm, 0.1, 500.0);
  table.Optional("start_rotation_rad", icp.start_rotation_rad, 0.001, 0.5);
  table.Optional("threshold_sigmas", icp.threshold_sigmas, 0.1, 10.0);
  table.Optional("threshold_floor_mm", icp.threshold_floor_mm, 0.01, 50.0);
  table.Optional("max_iterations", icp.max_iterations, 1, 1000);
  table.Optional("stop_mm", icp.stop_mm, 1e-6, 1.0);
  table.Optional("min_inlier_share", icp.min_inlier_share, 0.01, 1.0);
  table.Optional("rival_ratio", icp.rival_ratio, 0.0, 100.0);
  table.Optional("turned_ratio", icp.turned_ratio, 0.0, 100.0);
  table.Optional("max_distance_mm", config.classify.max_distance_mm, 0.1, 50.0);
  table.Optional("cloud_timeout_s", config.cloud_timeout_s, 0.1, 600.0);
  table.Optional("threads", threads, 0, 64);
  RETURN_IF_ERROR(table.Finish());
  icp.threads = config.classify.threads = static_cast<unsigned>(threads);
  RETURN_IF_ERROR(Check(icp));
  return config;
}

}  // namespace forgescan
