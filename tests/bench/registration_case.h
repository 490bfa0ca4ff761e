// What the registration benches share: 500,000 points of the test axle, 22 % of them foreign, start off by 10
// mm and 3 degrees.
#pragma once

#include <benchmark/benchmark.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "services/common/model/model_import.h"
#include "services/registration/icp.h"
#include "services/registration/sample_tree.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan::bench {

// What is asked of every competitor: the farthest corner of the part's box, mm. The goal for ours is 0.01; a
// peer that pairs with samples 2 mm apart is not held to that.
constexpr double kOursWithinMm = 0.01;
constexpr double kPeerWithinMm = 0.1;
constexpr double kSpacingMm = 2;

struct RegistrationCase {
  ModelBundle bundle = Must(testing::MakeAxle({}, kSpacingMm));
  RegistrationModel model = Must(RegistrationModel::Build(bundle));
  Eigen::Isometry3d scan_from_model = testing::RandomMotion(Eigen::Vector3d::Zero(), 0.0524, 10, 1);
  PointCloud scan = testing::Moved(testing::ScanOf(bundle, {500'000, 0.22, 0.03, 1}), scan_from_model);

  template <typename T>
  static T Must(Result<T> result) {
    if (!result.ok()) throw std::runtime_error(result.error().message);
    return std::move(result).value();
  }
};

inline const RegistrationCase& TheRegistration() {
  static const RegistrationCase only;
  return only;
}

// Enters how far the result is off; a result that is off too far is no result.
inline void Judge(benchmark::State& state, const Eigen::Isometry3d& model_from_scan, double within_mm) {
  const RegistrationCase& c = TheRegistration();
  const double worst_mm = CornerMotionMm(model_from_scan * c.scan_from_model, c.model);
  state.counters["corner_um"] = 1000 * worst_mm;
  if (!(worst_mm <= within_mm)) {
    state.SkipWithError(
        fmt::format("worst corner off by {:.4f} mm, allowed {} mm", worst_mm, within_mm).c_str());
  }
}

}  // namespace forgescan::bench
