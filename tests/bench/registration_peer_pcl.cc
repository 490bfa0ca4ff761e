// PCL's point-to-plane ICP, with its rejection of all but the nearest 70 % of the pairs.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/correspondence_rejection_trimmed.h>
#include <pcl/registration/icp.h>

#include "tests/bench/registration_case.h"

namespace forgescan::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;

Cloud::Ptr CloudOf(const std::vector<Eigen::Vector3f>& points, const std::vector<Eigen::Vector3f>& normals) {
  auto cloud = std::make_shared<Cloud>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    pcl::PointNormal p;
    p.getVector3fMap() = points[i];
    p.getNormalVector3fMap() = normals[i];
    cloud->push_back(p);
  }
  return cloud;
}

void BM_Pcl(benchmark::State& state) {
  const RegistrationCase& c = TheRegistration();
  const Cloud::Ptr source = CloudOf(c.scan.points, c.scan.normals);
  const Cloud::Ptr target = CloudOf(c.model.sample_points(), c.model.sample_normals());
  const auto trimmed = std::make_shared<pcl::registration::CorrespondenceRejectorTrimmed>();
  trimmed->setOverlapRatio(0.7F);
  for (auto _ : state) {
    pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal, double> icp;
    icp.setInputSource(source);
    icp.setInputTarget(target);
    icp.addCorrespondenceRejector(trimmed);
    icp.setMaxCorrespondenceDistance(61);  // as ours: how far the start can have the part off
    icp.setMaximumIterations(100);
    icp.setTransformationEpsilon(1e-10);
    icp.setTransformationRotationEpsilon(1 - 1e-10);
    icp.setEuclideanFitnessEpsilon(1e-10);
    Cloud aligned;
    icp.align(aligned);
    if (!icp.hasConverged()) return state.SkipWithError("did not converge");
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.matrix() = icp.getFinalTransformation();
    Judge(state, pose, kPeerWithinMm);
  }
}

BENCHMARK(BM_Pcl)
    ->Name("registration/pcl")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(3);

}  // namespace
}  // namespace forgescan::bench
