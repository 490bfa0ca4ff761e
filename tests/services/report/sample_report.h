// A part as the tests know it: an axle-like shape, its cloud with known deviations, and a report with every
// field set.
#pragma once

#include "services/common/geometry/point_cloud.h"
#include "services/report/part_report.h"

namespace forgescan {

// About an axle: a bar 1888 mm long along x, two plates across y, two ends of larger diameter. One point a
// `spacing_mm`. Deterministic. Frames: model. Units: mm.
PointCloud SampleAxle(double spacing_mm);

// Smooth, -0.8 to 0.8 mm along x.
std::vector<float> SampleDeviations(const PointCloud& cloud);

// Every field set, no picture; `count` parts of history.
PartReport SampleReport(int count);

}  // namespace forgescan
