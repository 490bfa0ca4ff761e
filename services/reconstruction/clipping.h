// Whether a camera cut off its grey values below full scale.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <vector>

#include "services/reconstruction/pattern_set.h"

namespace forgescan {

using Histogram = std::vector<long>;  // how often each raw grey value occurs

// The grey value at which the fringe frames were cut: their largest one, if it occurs far more often than the
// ones just below it. An unclipped maximum is the end of a tail; even the crests of ideal fringes without
// noise are only twice as frequent as what is below. About 32 rows are looked at; a plain white reference
// frame is left out. Shape: as FringeDecoder::Decode. Units: raw grey values of the frames. nullopt: not cut,
// or on fewer than 1 in 10,000 of the values.
std::optional<int> FindClippingLevel(std::span<const cv::Mat> frames, const PatternSet& pattern, int threads);

// The same of the plain reference frame, which is brighter than the fringes and may be cut where they are
// not. lit: its values where there are fringes. If they are all equal, it is cut: light scatters.
std::optional<int> ReferenceClippingLevel(const Histogram& lit);

}  // namespace forgescan
