// Registration and what belongs to it, and the paper's algorithm on the same data. Peers:
// registration_peer_*.cc.
#include "services/common/parallel_blocks.h"
#include "services/registration/classify.h"
#include "services/registration/paper_icp.h"
#include "services/registration/pose_search.h"
#include "tests/bench/registration_case.h"

namespace forgescan::bench {
namespace {

void Register(benchmark::State& state, unsigned threads, double rival_ratio) {
  const RegistrationCase& c = TheRegistration();
  IcpOptions options;
  options.threads = threads;
  options.rival_ratio = rival_ratio;
  for (auto _ : state) {
    const auto result = RegisterScan(c.scan, c.model, Eigen::Isometry3d::Identity(), options);
    if (!result.ok()) return state.SkipWithError(result.error().message.c_str());
    state.counters["iterations"] = result->iterations;
    Judge(state, result->model_from_scan, kOursWithinMm);
  }
}

void BM_Ours(benchmark::State& state) { Register(state, 1, IcpOptions().rival_ratio); }
void BM_OursTwoThreads(benchmark::State& state) { Register(state, 2, IcpOptions().rival_ratio); }
void BM_OursWithoutRivalCheck(benchmark::State& state) { Register(state, 1, 0); }

void BM_Paper(benchmark::State& state) {
  const RegistrationCase& c = TheRegistration();
  const SampleTree tree(c.model.sample_points());
  const auto search = [&tree](std::span<const Eigen::Vector3f> queries) { return tree.Find(queries); };
  for (auto _ : state) {
    const auto result = RegisterAsInPaper(c.scan, c.model, search, Eigen::Isometry3d::Identity(), {});
    if (!result.ok()) return state.SkipWithError(result.error().message.c_str());
    if (!result->at_rest) return state.SkipWithError("not at rest after 300 iterations");
    state.counters["iterations"] = result->iterations;
    Judge(state, result->model_from_scan, kPeerWithinMm);
  }
}

void BM_BuildModel(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(RegistrationModel::Build(TheRegistration().bundle));
}

void Classify(benchmark::State& state, unsigned threads) {
  const RegistrationCase& c = TheRegistration();
  ClassifyOptions options;
  options.threads = threads;
  for (auto _ : state) {
    benchmark::DoNotOptimize(FindPartPoints(c.scan, c.model, c.scan_from_model.inverse(), options));
  }
}

void BM_Classify(benchmark::State& state) { Classify(state, 1); }
void BM_ClassifyTwoThreads(benchmark::State& state) { Classify(state, 2); }

void BM_Search(benchmark::State& state) {
  const RegistrationCase& c = TheRegistration();
  const Eigen::Isometry3d turned(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 2, -1).normalized()));
  const PointCloud scan = testing::Moved(c.scan, turned);
  IcpOptions options;
  options.threads = 1;
  for (auto _ : state) {
    const auto result = SearchPose(scan, c.model, options);
    if (!result.ok()) return state.SkipWithError(result.error().message.c_str());
    Judge(state, result->model_from_scan * turned, kOursWithinMm);
  }
}

BENCHMARK(BM_Ours)->Name("registration/ours")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_OursTwoThreads)
    ->Name("registration/ours/threads:2")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(BM_OursWithoutRivalCheck)
    ->Name("registration/ours_without_rival_check")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
// Minutes: once a repetition, and no more than three of them.
BENCHMARK(BM_Paper)
    ->Name("registration/paper")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(3);
BENCHMARK(BM_BuildModel)->Name("model_preparation/ours")->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Search)->Name("pose_search/ours")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_Classify)->Name("classification/ours")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_ClassifyTwoThreads)
    ->Name("classification/ours/threads:2")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace forgescan::bench

BENCHMARK_MAIN();
