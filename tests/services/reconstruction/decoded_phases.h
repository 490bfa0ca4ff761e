// The decoder on frames of phase_scene.h.
#pragma once

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "services/reconstruction/fringe_decoder.h"
#include "tests/services/reconstruction/phase_scene.h"

namespace forgescan {

inline FringeDecoder Decoder(const PatternSet& pattern, const ReconstructionConfig& config,
                             std::optional<SimdPath> path = BestSimdPath()) {
  auto decoder = FringeDecoder::Create(pattern, config, path);
  EXPECT_TRUE(decoder.ok());
  return std::move(decoder).value();
}

inline DecodedView Decode(const FringeDecoder& decoder, const std::vector<cv::Mat>& frames) {
  auto view = decoder.Decode(frames);
  EXPECT_TRUE(view.ok());
  return std::move(view).value();
}

// A pixel for each phase of the finest fringes, many times, so that bins of it can be compared with the
// formula.
inline Columns Sweep(cv::Size size) {
  Columns columns(size);
  cv::RNG random(7);
  random.fill(columns, cv::RNG::UNIFORM, 100.0, 1800.0);
  return columns;
}

}  // namespace forgescan
