#include "services/registration/rival_poses.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/registration/correspondences.h"
#include "services/registration/icp_stages.h"

namespace forgescan {
namespace {

constexpr std::size_t kProfilePoints = 400, kAlignPoints = 2'000, kSettlePoints = 1'000;
constexpr double kProfileStepMm = 1;   // a valley of the capped score is a few mm wide
constexpr int kMostProfileSteps = 40;  // to each side
constexpr double kRidge = 1.1;         // a valley lies behind a ridge this much higher than its bottom
constexpr std::size_t kMostValleys = 3;
constexpr int kRivalIterations = 20;
constexpr double kHopeless = 4;        // a rough alignment with so many times the score is not refined
constexpr int kMostSettleSteps = 20;
constexpr double kSettledMm = 1e-4;      // a step that moves less is the last
constexpr double kSettleDamping = 1e-6;  // a body of revolution stays turned as it is:
constexpr double kAnything = -1;         // no eigenvalue is too small
constexpr double kStartFactor = 2;       // as in RegisterScan's check against the start
constexpr double kSamePoseShare = 2;     // of the threshold's floor: nearer poses are the same valley

ScanSample Thinned(const ScanSample& sample, std::size_t most) {
  const std::size_t step = std::max<std::size_t>(1, (sample.size() + most - 1) / most);
  ScanSample thin;
  for (std::size_t i = 0; i < sample.size(); i += step) {
    thin.points.push_back(sample.points[i]);
    if (!sample.normals.empty()) thin.normals.push_back(sample.normals[i]);
  }
  return thin;
}

// Along (axis 0 to 2) or about (3 to 5) a model axis through the box's centre.
Eigen::Isometry3d MotionOf(const RegistrationModel& model, int axis, double far_end_mm) {
  if (axis < 3) return Eigen::Isometry3d(Eigen::Translation3d(far_end_mm * Eigen::Vector3d::Unit(axis)));
  const double angle = far_end_mm / FrameOf(model).reach_mm[axis - 3];
  const Eigen::Translation3d center(model.center());
  return center * Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis - 3)) * center.inverse();
}

double MeanOf(const std::vector<float>& values) {
  double sum = 0;
  for (const float v : values) sum += v;
  return sum / static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

struct Valley {
  Eigen::Isometry3d model_from_scan;
  double score_mm;
};

// Appends the valleys of the score along one axis to one side, behind a ridge.
void AddValleys(const RivalSearch& search, const ScanSample& few, const std::vector<Eigen::Isometry3d>& poses,
                std::vector<Valley>& valleys) {
  const IcpOptions& o = search.options;
  std::vector<double> scores;
  for (const auto& pose : poses) {
    scores.push_back(MeanOf(CappedDistances(few, search.model, pose, o.score_cap_mm, 1)));
  }
  double ridge_mm = 0;
  for (std::size_t i = 0; i + 1 < scores.size(); ++i) {
    const bool bottom = i > 0 && scores[i] <= scores[i - 1] && scores[i] < scores[i + 1];
    if (bottom && scores[i] * kRidge < ridge_mm) {
      valleys.push_back({poses[i], scores[i]});
      ridge_mm = scores[i];
    }
    ridge_mm = std::max(ridge_mm, scores[i]);
  }
}

// The lowest valleys along and about all axes.
std::vector<Valley> FindValleys(const RivalSearch& search) {
  const ScanSample few = Thinned(search.sample, kProfilePoints);
  std::vector<Valley> valleys;
  for (int axis = 0; axis < 6; ++axis) {
    const double range_mm = kStartFactor * (axis < 3 ? search.options.start_translation_mm
                                                     : search.options.start_rotation_rad *
                                                           FrameOf(search.model).reach_mm[axis - 3]);
    const int steps = std::clamp(static_cast<int>(range_mm / kProfileStepMm), 3, kMostProfileSteps);
    for (const double side : {-1.0, 1.0}) {
      std::vector<Eigen::Isometry3d> poses;
      for (int i = 0; i <= steps; ++i) {
        poses.push_back(MotionOf(search.model, axis, side * range_mm * i / steps) * search.found);
      }
      AddValleys(search, few, poses, valleys);
    }
  }
  std::stable_sort(valleys.begin(), valleys.end(),
                   [](const Valley& a, const Valley& b) { return a.score_mm < b.score_mm; });
  if (valleys.size() > kMostValleys) valleys.erase(valleys.begin() + kMostValleys, valleys.end());
  return valleys;
}

bool StartAllows(const RivalSearch& search, const Eigen::Isometry3d& start, const Eigen::Isometry3d& pose) {
  const Eigen::Isometry3d correction = pose * start.inverse();
  const Eigen::Vector3d center = search.model.center();
  return (correction * center - center).norm() <= kStartFactor * search.options.start_translation_mm &&
         Eigen::AngleAxisd(correction.linear()).angle() <= kStartFactor * search.options.start_rotation_rad;
}

// Of two rivals, the one nearer to a refusal.
bool IsStronger(const RivalPose& a, const RivalPose& b, const IcpOptions& options) {
  const auto pressure = [&](const RivalPose& r) {
    return r.scores.other_mm / (r.from_start ? options.rival_ratio : options.turned_ratio) / r.scores.one_mm;
  };
  return pressure(a) < pressure(b);
}

// The motion nearby that brings the model's samples onto its surface, by least squares.
std::optional<Eigen::Isometry3d> SettleOnItself(const ScanSample& samples, const RegistrationModel& model,
                                                Eigen::Isometry3d motion, double reach_mm) {
  IcpOptions options;
  options.threads = 1;
  for (int i = 0; i < kMostSettleSteps; ++i) {
    const std::vector<Pair> pairs = PairWithSurface(samples, model, motion, reach_mm, options);
    const auto step = SolveStep(pairs, FrameOf(model), {kAnything, kSettleDamping, 1});
    if (!step.ok()) return std::nullopt;
    motion = step->moved_from_before * motion;
    if (std::max(step->rotation_mm, step->translation_mm) < kSettledMm) break;
  }
  return motion;
}

}  // namespace

bool IsNearSymmetry(const RegistrationModel& model, const Eigen::Isometry3d& motion, double within_mm) {
  const ScanSample samples = Thinned({model.sample_points(), model.sample_normals()}, kSettlePoints);
  const double reach_mm = within_mm + model.symmetry_limit_mm();
  const auto distances = CappedDistances(samples, model, motion, 2 * reach_mm, 1);
  // No motion of the corners by within_mm brings such a sample onto the surface.
  if (std::ranges::any_of(distances, [&](float d) { return d > reach_mm; })) return false;
  const auto settled = SettleOnItself(samples, model, motion, 2 * reach_mm);
  return settled && CornerMotionMm(*settled * motion.inverse(), model) <= within_mm &&
         IsSymmetry(model, *settled);
}

PoseScores CompareScores(const ScanSample& sample, const RegistrationModel& model,
                         const Eigen::Isometry3d& one, const Eigen::Isometry3d& other,
                         const IcpOptions& options) {
  const double cap_mm = options.rival_cap_mm;
  const std::vector<float> of_one = CappedDistances(sample, model, one, cap_mm, options.threads);
  const std::vector<float> of_other = CappedDistances(sample, model, other, cap_mm, options.threads);
  double sum_one = 0, sum_other = 0, count = 0;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (std::min(of_one[i], of_other[i]) >= static_cast<float>(cap_mm)) continue;
    sum_one += of_one[i];
    sum_other += of_other[i];
    ++count;
  }
  return {sum_one / std::max(count, 1.0), sum_other / std::max(count, 1.0)};
}

std::optional<RivalPose> SettleRival(const RivalSearch& search, const Eigen::Isometry3d& from,
                                     double gate_mm) {
  IcpOptions options = search.options;
  options.max_iterations = kRivalIterations;
  options.min_eigenvalue = 0;
  options.threads = 1;  // so few points are done before another thread has begun
  const auto coarse = AlignCoarse(search.sample, search.model, options, {from, 0, gate_mm});
  if (!coarse.ok()) return std::nullopt;
  const auto compare = [&](const Eigen::Isometry3d& pose) {
    return CompareScores(search.sample, search.model, search.found, pose, options);
  };
  const PoseScores rough = compare(coarse->model_from_scan);
  if (rough.other_mm > kHopeless * rough.one_mm) return std::nullopt;
  const auto fine = AlignFine(search.sample, search.model, options, options.stop_mm,
                              BeginFine(search.model, options, *coarse));
  if (!fine.ok()) return std::nullopt;
  const Eigen::Isometry3d& pose = fine->align.model_from_scan;
  const Eigen::Isometry3d motion = pose * search.found.inverse();
  const double same_mm = kSamePoseShare * std::max(options.threshold_floor_mm, search.model.spacing_mm());
  if (CornerMotionMm(motion, search.model) < same_mm) return std::nullopt;
  const Eigen::AngleAxisd turn(motion.linear());
  const Eigen::Vector3d shift = motion * search.model.center() - search.model.center();
  return RivalPose{
      pose, compare(pose), false,
      fmt::format("({:.2f}, {:.2f}, {:.2f}) mm and {:.2f} degrees about ({:.2f}, {:.2f}, {:.2f})", shift.x(),
                  shift.y(), shift.z(), turn.angle() * 180 / std::numbers::pi, turn.axis().x(),
                  turn.axis().y(), turn.axis().z())};
}

std::optional<RivalPose> FindRival(const ScanSample& sample, const RegistrationModel& model,
                                   const Eigen::Isometry3d& start, const Eigen::Isometry3d& found,
                                   const IcpOptions& options) {
  const ScanSample some = Thinned(sample, kAlignPoints);
  const RivalSearch search{some, model, found, options};
  std::optional<RivalPose> strongest;
  const auto consider = [&](const Eigen::Isometry3d& from, double gate_mm, bool from_start) {
    auto rival = SettleRival(search, from, gate_mm);
    if (!rival || from_start != StartAllows(search, start, rival->model_from_scan)) return;
    rival->from_start = from_start;
    if (!strongest || IsStronger(*rival, *strongest, options)) strongest = std::move(rival);
  };
  for (const Valley& valley : FindValleys(search)) {
    consider(valley.model_from_scan, 2 * std::max(options.threshold_floor_mm, model.spacing_mm()), true);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (model.IsSymmetricAbout(axis)) continue;
    consider(HalfTurn(model, axis) * found, std::max(options.start_translation_mm, 1.0), false);
  }
  return strongest;
}

Status CheckRival(const RivalPose& rival, const IcpOptions& options) {
  const double limit = rival.from_start ? options.rival_ratio : options.turned_ratio;
  if (!(rival.scores.other_mm <= limit * rival.scores.one_mm)) return {};
  return Fail(ErrorCode::kUntrusted,
              "{}: the pose found leaves a mean distance of {:.4f} mm, another one {:.4f} mm; the ratio must "
              "be above "
              "{:.2f}; between them lie {}",
              rival.from_start ? "the pose is ambiguous" : "the part seems to lie turned",
              rival.scores.one_mm, rival.scores.other_mm, limit, rival.motion);
}

}  // namespace forgescan
