// The paper's algorithm with nanoflann's k-d tree in place of FLANN's.
#include <nanoflann.hpp>

#include "services/registration/paper_icp.h"
#include "tests/bench/registration_case.h"

namespace forgescan::bench {
namespace {

struct Points {
  const std::vector<Eigen::Vector3f>& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>, Points, 3>;

void BM_Nanoflann(benchmark::State& state) {
  const RegistrationCase& c = TheRegistration();
  const Points points{c.model.sample_points()};
  Tree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  tree.buildIndex();
  const auto search = [&tree](std::span<const Eigen::Vector3f> queries) {
    std::vector<NearestSample> nearest;
    for (const Eigen::Vector3f& query : queries) {
      std::uint32_t sample = 0;
      float squared = 0;
      tree.knnSearch(query.data(), 1, &sample, &squared);
      nearest.push_back({sample, std::sqrt(squared)});
    }
    return nearest;
  };
  for (auto _ : state) {
    const auto result = RegisterAsInPaper(c.scan, c.model, search, Eigen::Isometry3d::Identity(), {});
    if (!result.ok()) return state.SkipWithError(result.error().message.c_str());
    if (!result->at_rest) return state.SkipWithError("not at rest after 300 iterations");
    state.counters["iterations"] = result->iterations;
    Judge(state, result->model_from_scan, kPeerWithinMm);
  }
}

BENCHMARK(BM_Nanoflann)
    ->Name("registration/nanoflann")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1)
    ->Repetitions(3);

}  // namespace
}  // namespace forgescan::bench
