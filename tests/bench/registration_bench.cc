// Registration and classification of 500,000 points, 22 % of them foreign, start off by 10 mm and 3 degrees.
#include <benchmark/benchmark.h>

#include <stdexcept>

#include "services/common/model/model_import.h"
#include "services/registration/classify.h"
#include "services/registration/icp.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

struct Case {
  ModelBundle bundle = Must(testing::MakeAxle({}, 2));
  RegistrationModel model = Must(RegistrationModel::Build(bundle));
  Eigen::Isometry3d scan_from_model = testing::RandomMotion(Eigen::Vector3d::Zero(), 0.0524, 10, 1);
  PointCloud scan = testing::Moved(testing::ScanOf(bundle, {500'000, 0.22, 0.03, 1}), scan_from_model);

  template <typename T>
  static T Must(Result<T> result) {
    if (!result.ok()) throw std::runtime_error(result.error().message);
    return std::move(result).value();
  }
};

const Case& TheCase() {
  static const Case only;
  return only;
}

void BM_BuildModel(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(RegistrationModel::Build(TheCase().bundle));
}

void BM_Register(benchmark::State& state) {
  const Case& c = TheCase();
  IcpOptions options;
  options.threads = static_cast<unsigned>(state.range(0));
  for (auto _ : state) {
    const auto result = RegisterScan(c.scan, c.model, Eigen::Isometry3d::Identity(), options);
    if (!result.ok()) state.SkipWithError(result.error().message.c_str());
    const Eigen::Vector3d end(944, 90, 60);
    state.counters["end_error_um"] = 1000 * (result->model_from_scan * c.scan_from_model * end - end).norm();
    state.counters["iterations"] = result->iterations;
  }
}

void BM_Classify(benchmark::State& state) {
  const Case& c = TheCase();
  ClassifyOptions options;
  options.threads = static_cast<unsigned>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(FindPartPoints(c.scan, c.model, c.scan_from_model.inverse(), options));
  }
}

BENCHMARK(BM_BuildModel)->Name("model_preparation/ours")->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Register)->Name("registration/ours")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_Classify)->Name("classification/ours")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace forgescan

BENCHMARK_MAIN();
