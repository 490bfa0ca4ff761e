// The robot's error at one view of 5 MP, every eighth point kept: 160,000 points in raster order, of which a
// tenth stands still. One thread.
#include <benchmark/benchmark.h>

#include <cmath>
#include <random>

#include "services/fusion/visit_error.h"

namespace forgescan {
namespace {

constexpr int kColumns = 500, kRows = 320;
constexpr double kStepMm = 1.0;
constexpr float kSigmaMm = 0.02F;

// A tilted surface 600 mm away; what stands still is at its left border, 50 mm farther.
PointCloud MakeView(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, kSigmaMm);
  const Eigen::Vector3f normal = Eigen::Vector3f(0.2F, -0.3F, -1).normalized();
  PointCloud cloud;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const auto x = static_cast<float>(kStepMm * (column - kColumns / 2));
      const auto y = static_cast<float>(kStepMm * (row - kRows / 2));
      const float depth = (column < kColumns / 10 ? 650.F : 600.F) + 0.2F * x - 0.3F * y;
      cloud.points.push_back(Eigen::Vector3f(x, y, depth) + noise(random) * normal);
      cloud.normals.push_back(normal);
      cloud.sigma_mm.push_back(kSigmaMm);
    }
  }
  return cloud;
}

std::vector<SurfaceCell> Standing(const VisitErrorOptions& options) {
  std::vector<SurfaceCell> cells = SurfaceCells(MakeView(1), options.cells);
  std::erase_if(cells, [](const SurfaceCell& cell) { return cell.point.x() > -kStepMm * 0.4 * kColumns; });
  return cells;
}

void BM_Cells(benchmark::State& state) {
  const PointCloud cloud = MakeView(2);
  for ([[maybe_unused]] const auto& step : state) {
    auto cells = SurfaceCells(cloud, {});
    benchmark::DoNotOptimize(cells);
  }
}
BENCHMARK(BM_Cells)->Unit(benchmark::kMillisecond);

void BM_VisitError(benchmark::State& state) {
  VisitErrorOptions options;
  options.robot_shift_mm = 0.005;
  options.robot_turn_rad = 0.000024;
  const std::vector<SurfaceCell> standing = Standing(options);
  const PointCloud cloud = MakeView(2);
  for ([[maybe_unused]] const auto& step : state) {
    auto error = EstimateVisitError(standing, cloud, options);
    if (!error.ok() || error->cells < 500) state.SkipWithError("too few cells");
    benchmark::DoNotOptimize(error);
  }
}
BENCHMARK(BM_VisitError)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace forgescan

BENCHMARK_MAIN();
