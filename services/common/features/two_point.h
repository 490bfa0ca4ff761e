// Local sizes of a cylinder between opposite points.
#pragma once

#include <span>
#include <vector>

#include "services/common/features/cylinder_fit.h"
#include "services/common/features/influence_sum.h"

namespace forgescan {

// One local size: the points of two opposite patches of a section. Units: mm.
struct TwoPointSize {
  double size_mm = 0;
  double section_mm = 0;                   // along the axis
  std::vector<std::size_t> first, second;  // the points of each patch
};

struct TwoPointSizes {
  std::vector<TwoPointSize> sizes;  // by section, then by direction
  double seen_share = 0;            // of the directions of all sections, those with points on both sides
};

// Purpose: two-point sizes (ISO 14405-1: LP) across the least-squares axis, in sections 4 mm thick and
// directions 4 degrees wide; a patch is the mean of its points, 3 at least. sections_mm: places along the
// axis, from `origin`. Points beyond the fit's limit of rejection do not count.
TwoPointSizes MeasureTwoPoint(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                              const Eigen::Vector3d& origin, std::span<const double> sections_mm);

// Purpose: how far errors alone are expected to push the largest of the sizes outwards, or the smallest
// inwards, in standard deviations of one: at most sqrt(2 ln n) of n, dependent or not. Source: Boucheron,
// Lugosi, Massart, Concentration Inequalities, 2013, Theorem 2.5. n: of the scatter all sizes; of the
// patches, of sizes nearer than patch_mm around the section, as many as have patches of their own. 0 for n up
// to 1.
Extreme ExpectedExtreme(const TwoPointSizes& found, double radius_mm, double patch_mm);

// Purpose: variance of a single point about the mean of its patch, pooled over the patches of all sizes: the
// points of two alone say little of it. The form between patches is what a local size is there to show.
// Units: mm^2. 0 without sizes.
double TwoPointNoise(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                     std::span<const TwoPointSize> sizes);

// Weights of the points in the mean of the sizes given, without residuals.
WeighedPoints WeighTwoPoint(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                            std::span<const TwoPointSize> sizes);

}  // namespace forgescan
