// Robust fits of 200,000 points with 0.05 mm noise, one in ten an outlier: half a cylinder and a plane. Asked
// of everyone: the radius within 0.001 mm, the plane's height within 0.001 mm.
#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "services/common/features/cylinder_fit.h"
#include "services/common/features/plane_fit.h"

#ifdef FORGESCAN_HAVE_PCL
#include <pcl/features/normal_3d.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/sac_segmentation.h>
#endif

namespace forgescan {
namespace {

constexpr std::size_t kPoints = 200'000;
constexpr double kNoiseMm = 0.05, kOutliers = 0.1, kRadiusMm = 44.25, kAskedMm = 0.001;
constexpr std::uint64_t kSeed = 7;
const Eigen::Vector3d kAxis = Eigen::Vector3d(0.9, -0.3, 0.2).normalized();
const Eigen::Vector3d kCenter(12, -40, 33);

// 0.5 to 5 mm outside, or noise.
double Off(std::mt19937_64& random) {
  std::uniform_real_distribution<double> share(0, 1);
  if (share(random) < kOutliers) return 0.5 + 4.5 * share(random);
  return std::normal_distribution<double>(0, kNoiseMm)(random);
}

std::vector<Eigen::Vector3d> MakeHalfCylinder() {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> along(-60, 60), turn(0, std::numbers::pi);
  const Eigen::Vector3d u = kAxis.unitOrthogonal(), v = kAxis.cross(u);
  std::vector<Eigen::Vector3d> points;
  while (points.size() < kPoints) {
    const double angle = turn(random);
    points.emplace_back(kCenter + along(random) * kAxis +
                        (kRadiusMm + Off(random)) * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return points;
}

std::vector<Eigen::Vector3d> MakePlane() {
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> along(-60, 60), across(-40, 40);
  const Eigen::Vector3d u = kAxis.unitOrthogonal(), v = kAxis.cross(u);
  std::vector<Eigen::Vector3d> points;
  while (points.size() < kPoints) {
    points.emplace_back(kCenter + along(random) * u + across(random) * v + Off(random) * kAxis);
  }
  return points;
}

const std::vector<Eigen::Vector3d>& HalfCylinder() {
  static const std::vector<Eigen::Vector3d> points = MakeHalfCylinder();
  return points;
}

const std::vector<Eigen::Vector3d>& Plane() {
  static const std::vector<Eigen::Vector3d> points = MakePlane();
  return points;
}

void Judge(benchmark::State& state, double error_mm) {
  state.counters["error_um"] = 1000 * error_mm;
  if (!(std::abs(error_mm) <= kAskedMm)) state.SkipWithError("wrong by more than 0.001 mm");
}

// A peer that is not as exact as asked is timed all the same, if it found the shape at all: the table's ratio
// then is in its favour. error_um tells.
void JudgePeer(benchmark::State& state, double error_mm) {
  state.counters["error_um"] = 1000 * error_mm;
  if (!(std::abs(error_mm) <= kNoiseMm)) state.SkipWithError("wrong by more than the noise");
}

void FitCylinders(benchmark::State& state, const std::optional<CylinderStart>& start) {
  double radius_mm = 0;
  for (auto _ : state) {
    const auto fit = FitCylinder(HalfCylinder(), start, {});
    radius_mm = fit.ok() ? fit->radius_mm : 0;
  }
  Judge(state, radius_mm - kRadiusMm);
}

// As the inspection does it: from the nominal cylinder, which lies a little beside the real one.
void BM_Cylinder(benchmark::State& state) {
  FitCylinders(state, CylinderStart{kCenter + Eigen::Vector3d(0.5, 0.4, -0.3),
                                    kAxis + Eigen::Vector3d(0.002, 0.003, 0), kRadiusMm + 0.3});
}
void BM_CylinderWithoutStart(benchmark::State& state) { FitCylinders(state, std::nullopt); }

void BM_Plane(benchmark::State& state) {
  double height_mm = 1;
  for (auto _ : state) {
    const auto fit = FitPlane(Plane(), {});
    if (fit.ok()) height_mm = fit->Residual(kCenter);
  }
  Judge(state, height_mm);
}

BENCHMARK(BM_Cylinder)->Name("cylinder_fit/ours")->Unit(benchmark::kMillisecond);
BENCHMARK(BM_CylinderWithoutStart)->Name("cylinder_fit/ours_without_start")->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Plane)->Name("plane_fit/ours")->Unit(benchmark::kMillisecond);

#ifdef FORGESCAN_HAVE_PCL

pcl::PointCloud<pcl::PointXYZ>::Ptr ToPcl(const std::vector<Eigen::Vector3d>& points) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3d& p : points)
    cloud->emplace_back(p.cast<float>().x(), p.cast<float>().y(), p.cast<float>().z());
  return cloud;
}

// The tutorial's steps: normals from 50 neighbours, RANSAC with a cylinder, coefficients refined with the
// inliers, which are those within three sigmas.
void BM_CylinderPcl(benchmark::State& state) {
  const auto cloud = ToPcl(HalfCylinder());
  double radius_mm = 0;
  for (auto _ : state) {
    pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
    pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
    estimation.setSearchMethod(
        pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
    estimation.setInputCloud(cloud);
    estimation.setKSearch(50);
    estimation.compute(*normals);
    pcl::SACSegmentationFromNormals<pcl::PointXYZ, pcl::Normal> segmentation;
    segmentation.setOptimizeCoefficients(true);
    segmentation.setModelType(pcl::SACMODEL_CYLINDER);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setNormalDistanceWeight(0.1);
    segmentation.setMaxIterations(10'000);
    segmentation.setDistanceThreshold(3 * kNoiseMm);
    segmentation.setRadiusLimits(0, 100);
    segmentation.setInputCloud(cloud);
    segmentation.setInputNormals(normals);
    pcl::PointIndices inliers;
    pcl::ModelCoefficients coefficients;
    segmentation.segment(inliers, coefficients);
    radius_mm = coefficients.values.size() == 7 ? static_cast<double>(coefficients.values[6]) : 0;
  }
  JudgePeer(state, radius_mm - kRadiusMm);
}

void BM_PlanePcl(benchmark::State& state) {
  const auto cloud = ToPcl(Plane());
  double height_mm = 1;
  for (auto _ : state) {
    pcl::SACSegmentation<pcl::PointXYZ> segmentation;
    segmentation.setOptimizeCoefficients(true);
    segmentation.setModelType(pcl::SACMODEL_PLANE);
    segmentation.setMethodType(pcl::SAC_RANSAC);
    segmentation.setDistanceThreshold(3 * kNoiseMm);
    segmentation.setInputCloud(cloud);
    pcl::PointIndices inliers;
    pcl::ModelCoefficients coefficients;
    segmentation.segment(inliers, coefficients);
    if (coefficients.values.size() != 4) continue;
    const Eigen::Vector3d normal(coefficients.values[0], coefficients.values[1], coefficients.values[2]);
    height_mm = (normal.dot(kCenter) + static_cast<double>(coefficients.values[3])) / normal.norm();
  }
  JudgePeer(state, height_mm);
}

BENCHMARK(BM_CylinderPcl)->Name("cylinder_fit/pcl")->Unit(benchmark::kMillisecond);
BENCHMARK(BM_PlanePcl)->Name("plane_fit/pcl")->Unit(benchmark::kMillisecond);
#endif

}  // namespace
}  // namespace forgescan

BENCHMARK_MAIN();
