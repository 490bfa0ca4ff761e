#include "services/common/features/dimension_measurer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "services/common/features/two_point.h"

namespace forgescan {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kLeastEndFaceCosine = 0.9;  // to the datum axis, 26 degrees: above, it is no end face
constexpr double kEndShare = 0.995;  // of the points of an end that is not plane lie within the length
constexpr std::size_t kLeastIdealPoints = 20;
constexpr double kWholeSection = 0.9;  // of the directions: with fewer a rank order may miss its size
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// The end of a length: where it lies along the axis, and how well that is known.
struct End {
  double at_mm = 0;
  double variance_mm2 = 0;
  std::string remark;
};

class Measurer {
 public:
  Measurer(const FaceFits& fits, std::span<const Eigen::Vector3d> middles, const DimensionOptions& options)
      : fits_(fits), options_(options), sum_(middles, options.influence) {}

  Result<DimensionMeasurement> Measure(const DimensionSpec& spec) {
    const auto value = spec.type == DimensionType::kLength  ? Length(spec)
                       : spec.type == DimensionType::kWidth ? Width(spec)
                                                            : Diameter(spec);
    if (!value.ok()) return value.error();
    made_.value_mm = *value;
    made_.influence = sum_.Take();
    made_.influence.extreme = extreme_;
    return made_;
  }

 private:
  void Remark(const std::string& remark) {
    made_.remark += made_.remark.empty() ? remark : fmt::format("; {}", remark);
  }

  void Count(const FitQuality& quality) {
    made_.points += quality.used();
    made_.rejected += quality.rejected;
    made_.range_mm = std::max(made_.range_mm, quality.range_mm);
  }

  void Gather(WeighedPoints seen, const FaceCloud& cloud, const WeighedPoints& ideal, double unknowns) {
    seen.views = cloud.views;
    sum_.Add(seen, ideal, unknowns);
    CountShell(seen.weights, seen.residuals);
  }

  // residuals: of the points from the face as a whole.
  void CountShell(const std::vector<double>& weights, const std::vector<double>& residuals) {
    std::vector<double> used;
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      if (weights[i] != 0) used.push_back(residuals[i]);
    }
    if (!used.empty()) made_.d95_mm = std::max(made_.d95_mm, ThinnestShellMm(std::move(used)));
  }

  Status GatherPlane(const std::string& face, const PlaneFit& plane, const Eigen::Vector3d& at,
                     double factor) {
    ASSIGN_OR_RETURN(const FaceCloud seen, fits_.Seen({face}));
    const FaceCloud cover = fits_.Ideal({face});
    WeighedPoints ideal;
    if (cover.points.size() >= kLeastIdealPoints)
      ideal = WeighHeight(cover.points, plane, at, kNoLimit, factor);
    Gather(WeighHeight(seen.points, plane, at, plane.quality.limit_mm, factor), seen, ideal,
           PlaneFit::kUnknowns);
    Count(plane.quality);
    return {};
  }

  Result<double> Diameter(const DimensionSpec& spec) {
    ASSIGN_OR_RETURN(const CylinderFit fit, fits_.Cylinder(spec.faces));
    const std::string arc =
        fmt::format("the points cover an arc of {:.0f} degrees, at least {:.0f} are needed", fit.arc_deg,
                    options_.min_arc_deg);
    if (fit.radius_constrained) return Fail(ErrorCode::kDegenerate, "radius constrained: {}", arc);
    if (fit.axis_constrained) {
      Remark(fmt::format("radius constrained: the axis is held at the nominal one, as {}", arc));
    }
    ASSIGN_OR_RETURN(const FaceCloud seen, fits_.Seen(spec.faces));
    Count(fit.quality);
    if (spec.definition != SizeDefinition::kLeastSquares) return TwoPoint(spec, fit, seen);
    const FaceCloud cover = fits_.Ideal(spec.faces);
    WeighedPoints ideal;
    if (cover.points.size() >= kLeastIdealPoints) ideal = WeighDiameter(cover.points, fit, kNoLimit);
    Gather(WeighDiameter(seen.points, fit, fit.quality.limit_mm), seen, ideal, CylinderFit::kUnknowns);
    made_.definition = "GG (ISO 14405-1): diameter of the least-squares cylinder";
    made_.uncertainty_mm = 2 * fit.RadiusUncertaintyMm();
    return 2 * fit.radius_mm;
  }

  // Rank order over all directions and sections; the two-point size itself stands where the part is seen from
  // both sides only, and a part of them may miss the largest and the smallest.
  Result<double> TwoPoint(const DimensionSpec& spec, CylinderFit fit, const FaceCloud& seen) {
    const ModelFace& nominal = fits_.Nominal(spec.faces.back());
    if (fit.axis.dot(nominal.direction) < 0) fit.axis = -fit.axis;
    TwoPointSizes found = MeasureTwoPoint(seen.points, fit, nominal.point, spec.sections_mm);
    if (spec.definition != SizeDefinition::kTwoPointMean) {
      extreme_ = ExpectedExtreme(found, fit.radius_mm, options_.influence.patch_cell_mm);
    }
    auto& sizes = found.sizes;
    if (sizes.empty()) {
      return Fail(ErrorCode::kDegenerate, "in no section are opposite points of '{}' seen",
                  spec.faces.back());
    }
    if (found.seen_share < kWholeSection) {
      Remark(fmt::format("two-point sizes are seen in {:.0f} % of the directions of the sections only",
                         100 * found.seen_share));
    }
    const double noise_mm2 = TwoPointNoise(seen.points, fit, sizes);
    std::sort(sizes.begin(), sizes.end(), [](const auto& x, const auto& y) { return x.size_mm < y.size_mm; });
    if (spec.definition == SizeDefinition::kTwoPointMax) sizes.erase(sizes.begin(), sizes.end() - 1);
    if (spec.definition == SizeDefinition::kTwoPointMin) sizes.resize(1);
    double sum = 0, variance = 0;
    for (const TwoPointSize& size : sizes) {
      sum += size.size_mm;
      variance +=
          1.0 / static_cast<double>(size.first.size()) + 1.0 / static_cast<double>(size.second.size());
    }
    const auto count = static_cast<double>(sizes.size());
    GatherTwoPoint(sizes, fit, seen, noise_mm2);
    made_.definition = fmt::format("{} (ISO 14405-1): two-point size in {} sections",
                                   SizeDefinitionName(spec.definition), spec.sections_mm.size());
    made_.uncertainty_mm = fit.quality.sigma_mm * std::sqrt(variance) / count;
    return sum / count;
  }

  // A local size contains the form of its place: there is no form that it misses.
  void GatherTwoPoint(std::span<const TwoPointSize> sizes, const CylinderFit& fit, const FaceCloud& seen,
                      double noise_mm2) {
    WeighedPoints weighed = WeighTwoPoint(seen.points, fit, sizes);
    weighed.views = seen.views;
    sum_.Add(weighed, noise_mm2);
    std::vector<double> residuals;
    for (const Eigen::Vector3d& p : seen.points) residuals.push_back(fit.Residual(p));
    CountShell(weighed.weights, residuals);
  }

  Result<double> Width(const DimensionSpec& spec) {
    ASSIGN_OR_RETURN(const PlaneFit first, fits_.Plane(spec.faces[0]));
    ASSIGN_OR_RETURN(const PlaneFit second, fits_.Plane(spec.faces[1]));
    const double angle_rad = std::asin(std::min(1.0, first.normal.cross(second.normal).norm()));
    if (angle_rad > options_.max_angle_rad) {
      return Fail(ErrorCode::kDegenerate,
                  "faces '{}' and '{}' are {:.5f} rad from parallel, at most {:.5f} are allowed",
                  spec.faces[0], spec.faces[1], angle_rad, options_.max_angle_rad);
    }
    // The second plane's point is the mean of its points.
    RETURN_IF_ERROR(GatherPlane(spec.faces[0], first, second.point, 1));
    RETURN_IF_ERROR(GatherPlane(spec.faces[1], second, second.point, 1));
    made_.definition = fmt::format("mean distance of the points of '{}' from the least-squares plane of '{}'",
                                   spec.faces[1], spec.faces[0]);
    made_.uncertainty_mm =
        std::hypot(first.OffsetUncertaintyMm(second.point), second.OffsetUncertaintyMm(second.point));
    return std::abs(first.Residual(second.point));
  }

  Result<double> Length(const DimensionSpec& spec) {
    ASSIGN_OR_RETURN(const DatumAxis axis, fits_.Axis(spec.datum));
    Count(axis.quality);
    if (!axis.remark.empty()) Remark(axis.remark);
    made_.range_mm = 0;  // of the ends, not of the datum
    made_.definition = "along the datum axis, between the least-squares planes of the end faces";
    std::array<End, 2> ends;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto end = PlaneEnd(spec.faces[i], axis);
      if (end.ok()) {
        ends[i] = *end;
        continue;
      }
      if (end.error().code != ErrorCode::kUntrusted) return end.error();
      ASSIGN_OR_RETURN(ends[i], QuantileEnd(spec.faces[i], axis));
      made_.definition = "along the datum axis; quantiles of the points where an end is not plane";
      Remark(fmt::format("end '{}' is not plane ({}): its {:.1f} % quantile along the axis counts",
                         spec.faces[i], end.error().message, 100 * kEndShare));
    }
    made_.uncertainty_mm = std::sqrt(ends[0].variance_mm2 + ends[1].variance_mm2);
    return std::abs(ends[0].at_mm - ends[1].at_mm);
  }

  Result<End> PlaneEnd(const std::string& face, const DatumAxis& axis) {
    ASSIGN_OR_RETURN(const PlaneFit plane, fits_.Plane(face));
    const double cosine = plane.normal.dot(axis.direction);
    if (std::abs(cosine) < kLeastEndFaceCosine) {
      return Fail(ErrorCode::kDegenerate, "face '{}' stands at {:.1f} degrees to the datum axis", face,
                  std::acos(std::min(std::abs(cosine), 1.0)) * kDegreesPerRadian);
    }
    End end;
    end.at_mm = plane.normal.dot(plane.point - axis.point) / cosine;
    const Eigen::Vector3d at = axis.point + end.at_mm * axis.direction;
    end.variance_mm2 = std::pow(plane.OffsetUncertaintyMm(at) / cosine, 2);
    RETURN_IF_ERROR(GatherPlane(face, plane, at, 1 / std::abs(cosine)));
    return end;
  }

  // Where all but half a per cent of the face's points end, seen from the middle of the part.
  Result<End> QuantileEnd(const std::string& face, const DatumAxis& axis) {
    ASSIGN_OR_RETURN(const FaceCloud seen, fits_.Seen({face}));
    const double outward = fits_.Nominal(face).direction.dot(axis.direction) < 0 ? -1 : 1;
    std::vector<double> along;
    for (const Eigen::Vector3d& p : seen.points) {
      along.push_back(outward * (p - axis.point).dot(axis.direction));
    }
    std::vector<double> sorted = along;
    std::sort(sorted.begin(), sorted.end());
    const double last = static_cast<double>(sorted.size() - 1);
    const double quantile = sorted[static_cast<std::size_t>(std::lround(kEndShare * last))];
    // Its points are those beyond it, and as many short of it.
    const double from = sorted[static_cast<std::size_t>(std::lround((2 * kEndShare - 1) * last))];
    WeighedPoints weighed;
    weighed.points = seen.points;
    const double count =
        static_cast<double>(std::count_if(along.begin(), along.end(), [&](double x) { return x >= from; }));
    for (const double x : along) weighed.weights.push_back(x >= from ? 1 / count : 0);
    for (const double x : along) weighed.residuals.push_back(x - quantile);
    weighed.normals.assign(along.size(), outward * axis.direction);
    const Eigen::Vector3d u = axis.direction.unitOrthogonal(), v = axis.direction.cross(u);
    for (const Eigen::Vector3d& p : seen.points) weighed.places.emplace_back(u.dot(p), v.dot(p));
    Gather(weighed, seen, {}, 1);
    made_.points += seen.points.size();
    return End{outward * quantile, std::pow((sorted.back() - from) / std::sqrt(count), 2), ""};
  }

  const FaceFits& fits_;
  const DimensionOptions& options_;
  InfluenceSum sum_;
  Extreme extreme_;
  DimensionMeasurement made_;
};

}  // namespace

Result<DimensionMeasurement> MeasureDimension(const DimensionSpec& spec, const FaceFits& fits,
                                              std::span<const Eigen::Vector3d> middles,
                                              const DimensionOptions& options) {
  return Measurer(fits, middles, options).Measure(spec);
}

}  // namespace forgescan
