#include "services/registration/paper_icp.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace forgescan {
namespace {

constexpr int kStillSteps = 3;
constexpr std::size_t kUnknowns = 6;
constexpr double kLeastSingularShare = 1e-12;  // of the largest: below, rounding decides

using Row = Eigen::Matrix<double, 6, 1>;
using System = Eigen::Matrix<double, 6, 6>;

// Step 4, Eq. (6).
double Threshold(const std::vector<NearestSample>& nearest, double sigmas) {
  double sum = 0, squares = 0;
  for (const NearestSample& hit : nearest) {
    sum += hit.distance_mm;
    squares += static_cast<double>(hit.distance_mm) * hit.distance_mm;
  }
  const auto count = static_cast<double>(nearest.size());
  const double mean = sum / count;
  return mean + sigmas * std::sqrt(std::max(squares / count - mean * mean, 0.0));
}

// Steps 4 and 5: numbers of the pairs that are kept, in the order of the scan.
std::vector<std::size_t> Keep(const std::vector<NearestSample>& nearest, const PaperIcpOptions& options) {
  const double threshold_mm = Threshold(nearest, options.threshold_sigmas);
  std::vector<std::size_t> kept;
  kept.reserve(nearest.size());
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i].distance_mm <= threshold_mm) kept.push_back(i);
  }
  const auto count = static_cast<std::size_t>(options.keep_share * static_cast<double>(kept.size()));
  std::nth_element(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(count), kept.end(),
                   [&](std::size_t i, std::size_t j) {
                     return std::tie(nearest[i].distance_mm, i) < std::tie(nearest[j].distance_mm, j);
                   });
  kept.resize(count);
  std::sort(kept.begin(), kept.end());
  return kept;
}

// Eq. (7); angles (alpha, beta, gamma) about x, y, z.
Eigen::Matrix3d Rotation(const Eigen::Vector3d& angles) {
  return (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

// Step 6, Eq. (8), about `center`: the paper's origin lies in the part.
Result<Row> Solve(const std::vector<Eigen::Vector3f>& points, const std::vector<NearestSample>& nearest,
                  const std::vector<std::size_t>& kept, const RegistrationModel& model) {
  System left = System::Zero();
  Row right = Row::Zero();
  for (const std::size_t i : kept) {
    const Eigen::Vector3d p = points[i].cast<double>() - model.center();
    const Eigen::Vector3d q = model.sample_points()[nearest[i].sample].cast<double>() - model.center();
    const Eigen::Vector3d n = model.sample_normals()[nearest[i].sample].cast<double>();
    Row row;
    row << p.cross(n), n;
    left += row * row.transpose();
    right += row * n.dot(q - p);
  }
  const Eigen::JacobiSVD<System> svd(left, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto& singular = svd.singularValues();
  if (kept.size() < kUnknowns || !(singular[5] > kLeastSingularShare * singular[0])) {
    return Fail(ErrorCode::kDegenerate, "{} point pairs are left and do not fix the pose", kept.size());
  }
  return Row(svd.solve(right));
}

}  // namespace

Result<PaperRegistration> RegisterAsInPaper(const PointCloud& scan, const RegistrationModel& model,
                                            const SampleSearch& search, const Eigen::Isometry3d& start,
                                            const PaperIcpOptions& options) {
  const auto finite = [](const Eigen::Vector3f& p) { return p.allFinite(); };
  if (!std::all_of(scan.points.begin(), scan.points.end(), finite) || !start.matrix().allFinite()) {
    return Fail(ErrorCode::kInvalidArgument, "the scan or the start has numbers that are not finite");
  }
  PaperRegistration result{start, 0, false};
  int still = 0;
  for (; result.iterations < options.max_iterations && still < kStillSteps; ++result.iterations) {
    std::vector<Eigen::Vector3f> points;
    points.reserve(scan.points.size());
    for (const auto& p : scan.points) {
      points.emplace_back((result.model_from_scan * p.cast<double>()).cast<float>());
    }
    const std::vector<NearestSample> nearest = search(points);
    ASSIGN_OR_RETURN(const Row step, Solve(points, nearest, Keep(nearest, options), model));
    Eigen::Isometry3d motion(Rotation(step.head<3>()));
    motion.pretranslate(model.center() + step.tail<3>() - motion.linear() * model.center());
    result.model_from_scan = motion * result.model_from_scan;
    const double far_end_mm = std::max(step.head<3>().norm() * model.reach_mm(), step.tail<3>().norm());
    still = far_end_mm < options.stop_mm ? still + 1 : 0;
  }
  result.at_rest = still >= kStillSteps;
  return result;
}

}  // namespace forgescan
