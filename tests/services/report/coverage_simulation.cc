#include "tests/services/report/coverage_simulation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "services/common/features/dimensions.h"
#include "services/common/parallel_blocks.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan::testing {
namespace {

// As the path of the virtual station: along the front from left to right, back along the rear.
struct View {
  Eigen::Vector3d target, towards;
};
const View kViews[] = {{{-880, 0, 0}, {-0.55, 0.59, 0.59}}, {{-500, 70, 40}, {0, 0.9, 0.43}},
                       {{0, 0, 0}, {0, 0.7, 0.7}},          {{500, 70, 40}, {0, 0.9, 0.43}},
                       {{880, 0, 0}, {0.55, 0.59, 0.59}},   {{880, 0, 0}, {0.55, -0.59, 0.59}},
                       {{500, -70, 40}, {0, -0.9, 0.43}},   {{0, 0, 0}, {0, -0.7, 0.7}},
                       {{-500, -70, 40}, {0, -0.9, 0.43}},  {{-880, 0, 0}, {-0.55, -0.59, 0.59}}};
constexpr double kLeastCosine = 0.34;  // 70 degrees: flatter is not seen
constexpr double kFieldMm = 220;       // half the width of what a view sees
constexpr int kModes = 64;             // waves a random field is made of
// A Gaussian correlation of length l has the variance of independent squares with sides of 2.5 l.
constexpr double kCellPerLength = 2.5066;
constexpr double kLengthSdMm = 0.15, kWidthSdMm = 0.05, kDiameterSdMm = 0.04;  // from part to part

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double Normal(double sigma) { return sigma * normal_(random_); }
  Eigen::Vector3d Vector(double sigma) {
    const double x = Normal(sigma), y = Normal(sigma), z = Normal(sigma);
    return {x, y, z};
  }
  double Turn() { return std::uniform_real_distribution<double>(0, 2 * std::numbers::pi)(random_); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

// A smooth random function of place with standard deviation sigma and a Gaussian correlation.
class Field {
 public:
  Field(Draw& draw, double sigma, double length_mm) : amplitude_(sigma * std::sqrt(2.0 / kModes)) {
    for (int i = 0; i < kModes; ++i) waves_.push_back({draw.Vector(1 / length_mm), draw.Turn()});
  }
  double At(const Eigen::Vector3d& p) const {
    double sum = 0;
    for (const Wave& wave : waves_) sum += std::cos(wave.vector.dot(p) + wave.phase);
    return amplitude_ * sum;
  }

 private:
  struct Wave {
    Eigen::Vector3d vector;
    double phase;
  };
  double amplitude_;
  std::vector<Wave> waves_;
};

// A point of the nominal surface, and which of the measured faces it is on.
struct SurfacePoint {
  Eigen::Vector3d point, normal;
  int face;  // 0, 1: ends; 2, 3: cylinders; 4..7: plates, left before right, front before back; -1: another
};

int FaceOf(const Eigen::Vector3d& p, const Eigen::Vector3d& normal, const AxleSize& size) {
  const int right = p.x() > 0 ? 1 : 0;
  if (std::abs(std::abs(p.x()) - size.total_length_mm / 2) < 1e-3) return right;
  const double radius = (right ? size.right_diameter_mm : size.left_diameter_mm) / 2;
  if (std::abs(p.x()) > 815 && std::abs(std::hypot(p.y(), p.z()) - radius) < 0.05) return 2 + right;
  const double half_width = (right ? size.right_width_mm : size.left_width_mm) / 2;
  if (std::abs(normal.y()) > 0.9 && std::abs(std::abs(p.y()) - half_width) < 1e-3) {
    return 4 + 2 * right + (p.y() < 0 ? 1 : 0);
  }
  return -1;
}

// The deviation of one part from the design: a size for every face, and form.
struct Part {
  std::array<double, 8> out_mm;  // each face outwards
  Field form;

  static Part Make(Draw& draw, const CoverageOptions& options, double form_length_mm) {
    std::array<double, 8> out_mm{};
    const double length = draw.Normal(kLengthSdMm);
    out_mm[0] = out_mm[1] = length / 2;
    for (std::size_t i : {2, 3}) out_mm[i] = draw.Normal(kDiameterSdMm) / 2;
    for (std::size_t i : {4, 6}) out_mm[i] = out_mm[i + 1] = draw.Normal(kWidthSdMm) / 2;
    return {out_mm, Field(draw, options.form_mm, form_length_mm)};
  }
  Eigen::Vector3d Place(const SurfacePoint& at) const {
    if (at.face < 0) return at.point;
    return at.point + (out_mm[static_cast<std::size_t>(at.face)] + form.At(at.point)) * at.normal;
  }
};

// What is wrong with one view of one part.
struct ViewError {
  Eigen::Vector3d shift, turn;
  double scale, stretch;
  Field patches;

  static ViewError Make(Draw& draw, const UncertaintyBudget& b, double scale, double warmth_k,
                        double patch_length_mm) {
    const Eigen::Vector3d shift =
        draw.Vector(b.view_shift_mm) + draw.Vector(b.robot_shift_mm) + draw.Vector(b.refraction_mm);
    const Eigen::Vector3d turn = draw.Vector(b.view_turn_rad) + draw.Vector(b.robot_turn_rad);
    const double stretch = b.expansion_slope_per_k * (warmth_k + draw.Normal(b.view_temperature_k));
    return {shift, turn, scale, stretch, Field(draw, b.patch_mm, patch_length_mm)};
  }
  Eigen::Vector3d Move(const Eigen::Vector3d& p, const Eigen::Vector3d& middle) const {
    const Eigen::Vector3d arm = p - middle;
    return p + shift + turn.cross(arm) + scale * arm + stretch * p;
  }
};

class Simulation {
 public:
  static Result<Simulation> Build(const CoverageOptions& options) {
    ASSIGN_OR_RETURN(ModelBundle model, MakeAxle({}, 3));
    ASSIGN_OR_RETURN(const Features features, ParseFeatures(AxleFeatures(kAxleDimensions), "features.toml"));
    ASSIGN_OR_RETURN(Features bound, BindFeatures(features, model));
    std::vector<SurfacePoint> seen = Sample(model, options.surface_points, options.seed);
    std::vector<SurfacePoint> even = Sample(model, options.surface_points, options.seed + 1);
    std::erase_if(even, [](const SurfacePoint& at) { return at.face < 0; });
    DimensionOptions dimensions;
    dimensions.select.threads = 1;
    ASSIGN_OR_RETURN(DimensionEvaluator evaluator,
                     DimensionEvaluator::Build(std::move(model), std::move(bound), dimensions));
    Simulation simulation(options, std::move(evaluator), std::move(even));
    for (const View& view : kViews) simulation.views_.push_back(See(view, seen));
    return simulation;
  }

  struct Outcome {
    std::vector<double> error_mm, expanded_mm;  // NaN: no value
    std::vector<UncertaintyTerm> terms;         // of each dimension, one after the other
  };

  Result<Outcome> Measure(int number) const {
    Draw draw(options_.seed * 1'000'003 + static_cast<std::uint64_t>(number));
    const Part part =
        Part::Make(draw, options_, options_.form_lengths * influence_.form_cell_mm / kCellPerLength);
    ASSIGN_OR_RETURN(const auto truth, evaluator_.Evaluate(Exact(part)));
    ASSIGN_OR_RETURN(const auto measured, evaluator_.Evaluate(Scan(part, draw)));
    Outcome outcome;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (!truth[i].measured_mm || !measured[i].measured_mm) {
        return Fail(ErrorCode::kUntrusted, "{}: {}{}", truth[i].name, truth[i].reason, measured[i].reason);
      }
      const auto terms = UncertaintyTerms(options_.budget, measured[i].influence, *measured[i].measured_mm,
                                          measured[i].standard_uncertainty_mm);
      outcome.error_mm.push_back(*measured[i].measured_mm - *truth[i].measured_mm);
      outcome.expanded_mm.push_back(ExpandedUncertaintyMm(terms));
      outcome.terms.insert(outcome.terms.end(), terms.begin(), terms.end());
    }
    return outcome;
  }

  const Features& features() const { return evaluator_.features(); }

 private:
  struct Seen {
    std::vector<SurfacePoint> points;
    Eigen::Vector3d middle;
  };

  Simulation(const CoverageOptions& options, DimensionEvaluator evaluator, std::vector<SurfacePoint> even)
      : options_(options), evaluator_(std::move(evaluator)), even_(std::move(even)) {}

  // Faces that are not measured are needed for the views' middles only: one point in ten of theirs.
  static std::vector<SurfacePoint> Sample(const ModelBundle& model, std::size_t count, std::uint64_t seed) {
    const PointCloud cloud = ScanOf(model, {count, 0, 0, seed});
    std::vector<SurfacePoint> points;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3d point = cloud.points[i].cast<double>(), normal = cloud.normals[i].cast<double>();
      const int face = FaceOf(point, normal, {});
      if (face >= 0 || i % 10 == 0) points.push_back({point, normal, face});
    }
    return points;
  }

  static Seen See(const View& view, const std::vector<SurfacePoint>& surface) {
    Seen seen{{}, Eigen::Vector3d::Zero()};
    const Eigen::Vector3d towards = view.towards.normalized();
    for (const SurfacePoint& at : surface) {
      const Eigen::Vector3d arm = at.point - view.target;
      const bool in_field = (arm - arm.dot(towards) * towards).norm() < kFieldMm;
      if (!in_field || at.normal.dot(towards) < kLeastCosine) continue;
      seen.points.push_back(at);
      seen.middle += at.point;
    }
    seen.middle /= static_cast<double>(seen.points.size());
    return seen;
  }

  PointCloud Exact(const Part& part) const {
    PointCloud cloud;
    for (const SurfacePoint& at : even_) {
      cloud.points.push_back(part.Place(at).cast<float>());
      cloud.normals.push_back(at.normal.cast<float>());
    }
    return cloud;
  }

  PointCloud Scan(const Part& part, Draw& draw) const {
    const UncertaintyBudget& budget = options_.budget;
    const double scale = draw.Normal(budget.scanner_scale), warmth_k = draw.Normal(budget.temperature_k);
    const double height_mm = draw.Normal(budget.surface_mm);
    PointCloud cloud;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const ViewError error = ViewError::Make(
          draw, budget, scale, warmth_k, options_.patch_lengths * influence_.patch_cell_mm / kCellPerLength);
      for (const SurfacePoint& at : views_[v].points) {
        const double off_mm =
            at.face < 0 ? 0 : height_mm + draw.Normal(options_.noise_mm) + error.patches.At(at.point);
        cloud.points.push_back(
            error.Move(part.Place(at) + off_mm * at.normal, views_[v].middle).cast<float>());
        cloud.normals.push_back(at.normal.cast<float>());
        cloud.view.push_back(static_cast<std::uint16_t>(v));
      }
    }
    return cloud;
  }

  CoverageOptions options_;
  InfluenceOptions influence_;
  DimensionEvaluator evaluator_;
  std::vector<SurfacePoint> even_;
  std::vector<Seen> views_;
};

void Count(const Simulation::Outcome& outcome, std::size_t dimension, Coverage& sum) {
  const double error_mm = outcome.error_mm[dimension], expanded_mm = outcome.expanded_mm[dimension];
  ++sum.parts;
  sum.held += std::abs(error_mm) <= expanded_mm ? 1 : 0;
  sum.bias_mm += error_mm;
  sum.scatter_mm += error_mm * error_mm;
  sum.stated_mm += expanded_mm * expanded_mm / 4;
  const std::size_t terms = outcome.terms.size() / outcome.error_mm.size();
  const auto first = outcome.terms.begin() + static_cast<std::ptrdiff_t>(dimension * terms);
  sum.terms.assign(first, first + static_cast<std::ptrdiff_t>(terms));
}

void Finish(Coverage& sum) {
  const double parts = sum.parts;
  sum.bias_mm /= parts;
  sum.scatter_mm = std::sqrt(std::max(0.0, sum.scatter_mm / parts - sum.bias_mm * sum.bias_mm));
  sum.stated_mm = std::sqrt(sum.stated_mm / parts);
}

}  // namespace

Result<std::vector<Coverage>> SimulateCoverage(const CoverageOptions& options) {
  ASSIGN_OR_RETURN(const Simulation simulation, Simulation::Build(options));
  std::vector<Result<Simulation::Outcome>> outcomes(static_cast<std::size_t>(options.parts),
                                                    Simulation::Outcome{});
  ForEachBlock(outcomes.size(), 1, options.threads, [&](std::size_t, std::size_t begin, std::size_t) {
    outcomes[begin] = simulation.Measure(static_cast<int>(begin));
  });
  std::vector<Coverage> coverage;
  for (const DimensionSpec& spec : simulation.features().dimensions) {
    coverage.emplace_back();
    coverage.back().name = spec.name;
  }
  for (const auto& outcome : outcomes) {
    if (!outcome.ok()) return outcome.error();
    for (std::size_t i = 0; i < coverage.size(); ++i) Count(*outcome, i, coverage[i]);
  }
  for (Coverage& sum : coverage) Finish(sum);
  return coverage;
}

std::string CoverageTable(const std::vector<Coverage>& coverage) {
  std::string text = fmt::format("{:<20}{:>7}{:>10}{:>10}{:>12}{:>12}\n", "dimension", "parts", "within U",
                                 "bias mm", "scatter mm", "stated u mm");
  for (const Coverage& c : coverage) {
    text += fmt::format("{:<20}{:>7}{:>9.1f}%{:>10.4f}{:>12.4f}{:>12.4f}\n", c.name, c.parts, 100 * c.Share(),
                        c.bias_mm, c.scatter_mm, c.stated_mm);
  }
  text += "\ncontributions, standard uncertainty in mm (last part)\n";
  for (std::size_t t = 0; !coverage.empty() && t < coverage[0].terms.size(); ++t) {
    text += fmt::format("{:<28}", coverage[0].terms[t].name);
    for (const Coverage& c : coverage) text += fmt::format("{:>10.4f}", c.terms[t].standard_mm);
    text += "\n";
  }
  return text;
}

}  // namespace forgescan::testing
