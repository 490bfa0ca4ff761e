// Evenly spread samples of a triangle mesh.
#pragma once

#include <vector>

#include "services/common/geometry/triangle_index.h"
#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

constexpr std::size_t kMaxSamples = 20'000'000;

// Fills bundle.sample_*, spacing_mm and resolution_mm from its vertices and triangles: one sample per
// spacing_mm^2 of area, walked in triangle order, placed inside a triangle by a low-discrepancy sequence.
// Equal input gives equal bytes. Errors: kInvalidArgument if spacing_mm is not positive, the surface has no
// area, or it would take more than kMaxSamples.
Result<ModelBundle> SampleSurface(ModelBundle bundle, double spacing_mm);

// Source: Eq. (10). Mean distance of a point to its nearest other point, for points about spacing_mm apart;
// points with no neighbour within 3 x 3 x 3 cells of 2 x spacing_mm are left out; 0 if none has one.
double MeanNearestDistance(const std::vector<Eigen::Vector3f>& points, double spacing_mm);

}  // namespace forgescan
