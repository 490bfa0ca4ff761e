// Open3D's point-to-plane ICP with Tukey's loss, coarse to fine: its own advice for a start that is off.
#include <omp.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/RobustKernel.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>

#include "tests/bench/registration_case.h"

namespace forgescan::bench {
namespace {

namespace o3d = open3d::pipelines::registration;

open3d::geometry::PointCloud CloudOf(const std::vector<Eigen::Vector3f>& points,
                                     const std::vector<Eigen::Vector3f>& normals) {
  open3d::geometry::PointCloud cloud;
  for (const auto& p : points) cloud.points_.push_back(p.cast<double>());
  for (const auto& n : normals) cloud.normals_.push_back(n.cast<double>());
  return cloud;
}

void BM_Open3d(benchmark::State& state) {
  omp_set_num_threads(1);
  const RegistrationCase& c = TheRegistration();
  const auto source = CloudOf(c.scan.points, c.scan.normals);
  const auto target = CloudOf(c.model.sample_points(), c.model.sample_normals());
  for (auto _ : state) {
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    for (const double width_mm : {60.0, 10.0, 2.0}) {
      const o3d::TransformationEstimationPointToPlane estimation(std::make_shared<o3d::TukeyLoss>(width_mm));
      const auto result = o3d::RegistrationICP(source, target, width_mm, pose, estimation,
                                               o3d::ICPConvergenceCriteria(1e-8, 1e-8, 30));
      pose = result.transformation_;
    }
    Eigen::Isometry3d model_from_scan = Eigen::Isometry3d::Identity();
    model_from_scan.matrix() = pose;
    Judge(state, model_from_scan, kPeerWithinMm);
  }
}

BENCHMARK(BM_Open3d)
    ->Name("registration/open3d")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(3);

}  // namespace
}  // namespace forgescan::bench
