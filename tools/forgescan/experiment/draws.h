// What is random in the experiments themselves: streams apart from those of the virtual cell.
#pragma once

#include <initializer_list>

#include "tools/virtual_station/random.h"

namespace forgescan {

enum class Draw : std::uint64_t {
  kGreyNoise = 1001,
  kResponse,
  kScan,
  kStart,
  kGapSample,
  kRobotSeries,
  kBallBar,
  kBarCertificate,
  kBarCenters,
};

inline RandomStream DrawsOf(std::uint64_t seed, Draw use, std::initializer_list<int> key = {}) {
  return RandomStream(seed, static_cast<RandomUse>(use), key);
}

}  // namespace forgescan
