// Gathers what errors of the points do to a size: see influence.h.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "services/common/features/cylinder_fit.h"
#include "services/common/features/influence.h"
#include "services/common/features/plane_fit.h"

namespace forgescan {

// The points one feature was fitted to, and what each counts for the size. Shape: all spans are of one size.
struct WeighedPoints {
  std::span<const Eigen::Vector3d> points;
  std::span<const std::uint16_t> views;  // of the points; empty: one view saw all
  std::vector<double> weights;           // mm of the size per mm of the point's move outwards; 0: not used
  std::vector<Eigen::Vector3d> normals;  // outward, unit
  std::vector<double> residuals;         // mm
  std::vector<Eigen::Vector2d> places;   // along the face, mm: in its plane, or unrolled
};

// Weights of points in twice the radius of their least-squares cylinder. A point beyond limit_mm has none.
WeighedPoints WeighDiameter(std::span<const Eigen::Vector3d> points, const CylinderFit& cylinder,
                            double limit_mm);
// Weights of points in the height of their least-squares plane over `at`, times `factor`; normals are those
// of the plane.
WeighedPoints WeighHeight(std::span<const Eigen::Vector3d> points, const PlaneFit& plane,
                          const Eigen::Vector3d& at, double limit_mm, double factor);

struct InfluenceOptions {
  double form_cell_mm = 15;   // pieces of a face whose form errors have nothing to do with each other
  double patch_cell_mm = 12;  // pieces of a view's image whose errors have nothing to do with each other
};

// Purpose: gathers the influence of one size, feature by feature.
// Form: a face's form moves a size only as far as its points weigh otherwise than an even cover of the whole
// face would. Scatter between cells of form_cell_mm, beyond what the scatter within them explains, tells how
// large that form is; unseen cells are taken to have one like it.
class InfluenceSum {
 public:
  // middles: of every view, by its number. With fewer entries than a view's number its middle is the origin.
  InfluenceSum(std::span<const Eigen::Vector3d> middles, const InfluenceOptions& options)
      : middles_(middles), options_(options) {}

  // `ideal`: the same size's weights on an even cover of the whole face, true to the model; residuals unused.
  void Add(const WeighedPoints& seen, const WeighedPoints& ideal, double unknowns);
  // A size that no unseen form moves; noise_mm2: the variance of a single point. Residuals are not used.
  void Add(const WeighedPoints& seen, double noise_mm2);
  Influence Take() const;

 private:
  void AddViews(const WeighedPoints& seen);
  void AddPatches(const WeighedPoints& seen);
  void AddNoise(const WeighedPoints& seen, double noise_mm2);
  void AddForm(const WeighedPoints& seen, const WeighedPoints& ideal, double unknowns);

  std::span<const Eigen::Vector3d> middles_;
  InfluenceOptions options_;
  std::map<std::uint16_t, ViewInfluence> views_;
  double outward_ = 0, noise_mm2_ = 0, form_mm2_ = 0, patch2_ = 0;
};

// The mean of every view's points; zero for a view without points. Shape: one entry for each number up to the
// largest in `views`, which has one entry a point (or none: one view).
std::vector<Eigen::Vector3d> ViewMiddles(std::span<const Eigen::Vector3f> points,
                                         std::span<const std::uint16_t> views);

}  // namespace forgescan
