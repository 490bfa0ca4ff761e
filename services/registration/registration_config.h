// Configuration of the registration service: table [registration] of station.toml.
#pragma once

#include <Eigen/Geometry>

#include "services/common/config/config.h"
#include "services/registration/classify.h"
#include "services/registration/icp.h"

namespace forgescan {

struct RegistrationConfig {
  IcpOptions icp;
  ClassifyOptions classify;
  double cloud_timeout_s = 15.0;  // from a fusion's result to the last slice of its cloud
  // Pre-calibrated start (paper 2.2.2): where a part lies on average. Frames: model and array. mm.
  Eigen::Isometry3d model_from_array = Eigen::Isometry3d::Identity();

  static Result<RegistrationConfig> Load(ConfigTable table);
};

}  // namespace forgescan
