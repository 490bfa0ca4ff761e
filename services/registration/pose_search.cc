#include "services/registration/pose_search.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <optional>

#include "services/common/geometry/dense_solvers.h"
#include "services/common/parallel_blocks.h"
#include "services/registration/correspondences.h"
#include "services/registration/icp_stages.h"
#include "services/registration/rival_poses.h"

namespace forgescan {
namespace {

constexpr std::size_t kFirstPoints = 800, kSecondPoints = 2'000;
constexpr int kFirstIterations = 12, kSecondIterations = 30;
constexpr int kRolls = 12;                // about the longest axis, 30 degrees apart
constexpr std::size_t kSecondRound = 12;  // candidates that are aligned again, with more points,
constexpr std::size_t kThirdRound = 3;    // once more, with the half turns of the best one,
constexpr std::size_t kLastRound = 4;     // and that go through RegisterScan, unless they score
constexpr double kHopeless = 2;           // so many times worse than the best
constexpr double kGateShare = 0.1;        // of the model's reach: pairs farther apart do not count at first
constexpr double kFloorShare = 0.04;      // and this is where the threshold pauses, see AlignCoarse
constexpr double kScoreCapShare = 0.02;  // of the model's reach: distances count no more, in the first rounds
constexpr double kSamePoseMm = 2;        // corners closer than this: the same pose, found twice

// Frames: columns of axes are unit and right-handed, longest first; in the frame of the points.
struct PrincipalFrame {
  Eigen::Vector3d center;
  Eigen::Matrix3d axes;
};

PrincipalFrame PrincipalFrameOf(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p.cast<double>();
  PrincipalFrame frame;
  frame.center = sum / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& p : points) {
    const Eigen::Vector3d arm = p.cast<double>() - frame.center;
    spread += arm * arm.transpose();
  }
  frame.axes = EigensystemOf(spread).vectors.rowwise().reverse();
  if (frame.axes.determinant() < 0) frame.axes.col(2) *= -1;
  return frame;
}

// Every way to lay the scan's principal axes on the model's: which axis on which, its direction, and the roll
// about the longest.
std::vector<Eigen::Isometry3d> Starts(const PrincipalFrame& scan, const PrincipalFrame& model) {
  Eigen::Matrix3d next = Eigen::Matrix3d::Zero();  // cycles the axes
  next(0, 1) = next(1, 2) = next(2, 0) = 1;
  std::vector<Eigen::Isometry3d> starts;
  Eigen::Matrix3d order = Eigen::Matrix3d::Identity();
  for (int which = 0; which < 3; ++which, order = next * order) {
    for (const double flip : {0.0, std::numbers::pi}) {
      for (int roll = 0; roll < kRolls; ++roll) {
        const Eigen::Matrix3d turn =
            (Eigen::AngleAxisd(2 * std::numbers::pi * roll / kRolls, Eigen::Vector3d::UnitX()) *
             Eigen::AngleAxisd(flip, Eigen::Vector3d::UnitZ()))
                .toRotationMatrix();
        Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
        start.linear() = model.axes * turn * order * scan.axes.transpose();
        start.translation() = model.center - start.linear() * scan.center;
        starts.push_back(start);
      }
    }
  }
  return starts;
}

struct Candidate {
  Eigen::Isometry3d model_from_scan;
  double score_mm;
};

struct Round {
  const ScanSample& sample;
  const RegistrationModel& model;
  int iterations;
};

// A short alignment from there; nothing if it fails.
std::optional<Candidate> AlignOne(const Round& round, const Eigen::Isometry3d& start,
                                  const IcpOptions& options) {
  const double reach_mm = round.model.reach_mm();
  IcpOptions rough = options;
  rough.threads = 1;
  rough.max_iterations = round.iterations;
  rough.start_translation_mm = std::max(options.start_translation_mm, kFloorShare * reach_mm);
  const auto aligned = AlignCoarse(round.sample, round.model, rough, {start, 0, kGateShare * reach_mm});
  if (!aligned.ok()) return std::nullopt;
  const std::vector<float> distances = CappedDistances(round.sample, round.model, aligned->model_from_scan,
                                                       kScoreCapShare * reach_mm, rough.threads);
  const double sum = std::accumulate(distances.begin(), distances.end(), 0.0);
  return Candidate{aligned->model_from_scan, sum / static_cast<double>(distances.size())};
}

// From each of them, the best first.
std::vector<Candidate> AlignAll(const Round& round, const std::vector<Eigen::Isometry3d>& starts,
                                const IcpOptions& options) {
  std::vector<std::optional<Candidate>> aligned(starts.size());
  ForEachBlock(starts.size(), 1, options.threads, [&](std::size_t i, std::size_t, std::size_t) {
    aligned[i] = AlignOne(round, starts[i], options);
  });
  std::vector<Candidate> candidates;
  for (const auto& candidate : aligned) {
    if (candidate) candidates.push_back(*candidate);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score_mm < b.score_mm; });
  return candidates;
}

bool SamePose(const RegistrationModel& model, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return CornerMotionMm(a * b.inverse(), model) < kSamePoseMm;
}

// The first `most` of them that differ.
std::vector<Eigen::Isometry3d> BestDifferent(const RegistrationModel& model,
                                             const std::vector<Candidate>& candidates, std::size_t most) {
  std::vector<Eigen::Isometry3d> best;
  for (const Candidate& candidate : candidates) {
    const auto same = [&](const auto& other) { return SamePose(model, candidate.model_from_scan, other); };
    if (best.size() < most && std::none_of(best.begin(), best.end(), same)) {
      best.push_back(candidate.model_from_scan);
    }
  }
  return best;
}

// About the principal axes, in the model's frame.
std::vector<Eigen::Isometry3d> HalfTurns(const PrincipalFrame& model) {
  const Eigen::Translation3d center(model.center);
  std::vector<Eigen::Isometry3d> turns;
  for (int axis = 0; axis < 3; ++axis) {
    turns.emplace_back(center * Eigen::AngleAxisd(std::numbers::pi, model.axes.col(axis)) * center.inverse());
  }
  return turns;
}

// The half turned poses too: of all wrong poses they are the ones most like the right one.
std::vector<Eigen::Isometry3d> WithHalfTurns(const RegistrationModel& model,
                                             const std::vector<Candidate>& candidates,
                                             const std::vector<Eigen::Isometry3d>& turns) {
  std::vector<Eigen::Isometry3d> poses = BestDifferent(model, candidates, kThirdRound);
  if (poses.empty()) return poses;
  const Eigen::Isometry3d best = poses.front();
  for (const Eigen::Isometry3d& turn : turns) poses.push_back(turn * best);
  return poses;
}

// What the last round leaves. A pose that RegisterScan refuses, or that was not tried, still tells against
// the others.
struct Finalists {
  std::vector<Registration> passed;
  std::vector<Eigen::Isometry3d> refused;
};

// The best ones through RegisterScan. Errors: that of the best one, if none passes.
Result<Finalists> RegisterBest(const PointCloud& scan, const RegistrationModel& model,
                               const std::vector<Candidate>& candidates, const IcpOptions& options) {
  IcpOptions alone = options;  // the poses found are compared with each other
  alone.turned_ratio = 0;
  Finalists finalists;
  std::optional<Error> first;
  const auto starts = BestDifferent(model, candidates, candidates.size());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (i >= kLastRound) {
      finalists.refused.push_back(starts[i]);
      continue;
    }
    auto result = RegisterScan(scan, model, starts[i], alone);
    if (result.ok()) {
      finalists.passed.push_back(std::move(*result));
    } else {
      finalists.refused.push_back(starts[i]);
      if (!first) first = result.error();
    }
  }
  if (!finalists.passed.empty()) return finalists;
  return first ? *first : Fail(ErrorCode::kUntrusted, "no pose of the part explains the scan");
}

std::vector<Candidate> WithoutHopeless(std::vector<Candidate> candidates) {
  std::erase_if(candidates, [limit = kHopeless * candidates.front().score_mm](const Candidate& candidate) {
    return candidate.score_mm > limit;
  });
  return candidates;
}

// Of the poses that pass RegisterScan, the one that none of those behind it scores better than.
const Registration& BestOf(const ScanSample& sample, const RegistrationModel& model,
                           const std::vector<Registration>& passed, const IcpOptions& options) {
  const Registration* best = &passed.front();
  for (const Registration& other : passed) {
    const PoseScores scores =
        CompareScores(sample, model, best->model_from_scan, other.model_from_scan, options);
    if (scores.other_mm < scores.one_mm) best = &other;
  }
  return *best;
}

// Everything that may be said instead of `search.found`: what else passed, what was refused, and its own half
// turns.
std::vector<Eigen::Isometry3d> RivalsOf(const RivalSearch& search, const Finalists& finalists,
                                        const std::vector<Eigen::Isometry3d>& turns) {
  std::vector<Eigen::Isometry3d> from = finalists.refused, rivals;
  for (const Eigen::Isometry3d& turn : turns) from.emplace_back(turn * search.found);
  for (const Registration& other : finalists.passed) rivals.push_back(other.model_from_scan);
  for (const Eigen::Isometry3d& pose : from) {
    const auto settled = SettleRival(search, pose, std::max(search.options.start_translation_mm, 1.0));
    if (settled) rivals.push_back(settled->model_from_scan);
  }
  return rivals;
}

// The best pose, unless another one explains the scan about as well.
Result<Registration> Choose(const ScanSample& sample, const RegistrationModel& model,
                            const Finalists& finalists, const std::vector<Eigen::Isometry3d>& turns,
                            const IcpOptions& options) {
  Registration best = BestOf(sample, model, finalists.passed, options);
  for (const auto& other : RivalsOf({sample, model, best.model_from_scan, options}, finalists, turns)) {
    const Eigen::Isometry3d motion = other * best.model_from_scan.inverse();
    if (CornerMotionMm(motion, model) < kSamePoseMm || IsNearSymmetry(model, motion, kSamePoseMm)) continue;
    const PoseScores scores = CompareScores(sample, model, best.model_from_scan, other, options);
    best.rival_ratio = std::min(best.rival_ratio, scores.Ratio());
    if (scores.other_mm > options.rival_ratio * scores.one_mm) continue;
    return Fail(
        ErrorCode::kUntrusted,
        "the pose is ambiguous: one leaves a mean distance of {:.4f} mm, another, turned by {:.1f} degrees, "
        "{:.4f} mm; the ratio must be above {:.2f}",
        scores.one_mm, Eigen::AngleAxisd(motion.linear()).angle() * 180 / std::numbers::pi, scores.other_mm,
        options.rival_ratio);
  }
  return best;
}

}  // namespace

Result<Registration> SearchPose(const PointCloud& scan, const RegistrationModel& model,
                                const IcpOptions& options) {
  RETURN_IF_ERROR(Check(options));
  if (!scan.normals.empty() && scan.normals.size() != scan.points.size()) {
    return Fail(ErrorCode::kInvalidArgument, "the scan has {} points but {} normals", scan.points.size(),
                scan.normals.size());
  }
  std::vector<std::uint32_t> finite;
  for (std::uint32_t i = 0; i < scan.size(); ++i) {
    if (scan.points[i].allFinite()) finite.push_back(i);
  }
  const ScanSample few = TakeSample(scan, finite, kFirstPoints),
                   more = TakeSample(scan, finite, kSecondPoints);
  if (finite.size() < options.min_inliers || few.size() == 0) {
    return Fail(ErrorCode::kDegenerate, "the scan has {} finite points, at least {} are needed",
                finite.size(), options.min_inliers);
  }
  const PrincipalFrame model_frame = PrincipalFrameOf(model.sample_points());
  const auto starts = Starts(PrincipalFrameOf(more.points), model_frame), turns = HalfTurns(model_frame);
  const auto first = AlignAll({few, model, kFirstIterations}, starts, options);
  const auto second =
      AlignAll({more, model, kSecondIterations}, BestDifferent(model, first, kSecondRound), options);
  const auto third = AlignAll({more, model, kSecondIterations}, WithHalfTurns(model, second, turns), options);
  if (third.empty()) return Fail(ErrorCode::kUntrusted, "no pose of the part explains the scan");
  ASSIGN_OR_RETURN(const auto finalists, RegisterBest(scan, model, WithoutHopeless(third), options));
  return Choose(more, model, finalists, turns, options);
}

}  // namespace forgescan
