#include "tools/forgescan/experiment/envelope.h"

#include <algorithm>
#include <cmath>

#include "services/common/features/enclosing_ball.h"

namespace forgescan {
namespace {

double IsoRepeatability(const std::vector<Eigen::Vector3d>& centers) {
  const auto count = static_cast<double>(centers.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& c : centers) mean += c / count;
  double sum = 0, squares = 0;
  for (const Eigen::Vector3d& c : centers) sum += (c - mean).norm();
  for (const Eigen::Vector3d& c : centers) squares += std::pow((c - mean).norm() - sum / count, 2);
  return sum / count + 3 * std::sqrt(squares / (count - 1));
}

}  // namespace

Result<Envelope> EnvelopeOf(const std::vector<BallPair>& visits) {
  std::vector<Eigen::Vector3d> first, second, lines;
  for (const BallPair& pair : visits) {
    first.push_back(pair[0]);
    second.push_back(pair[1]);
    lines.push_back((pair[1] - pair[0]).normalized());
  }
  Envelope envelope;
  ASSIGN_OR_RETURN(const EnclosingBall a, MinimumEnclosingBall(first));
  ASSIGN_OR_RETURN(const EnclosingBall b, MinimumEnclosingBall(second));
  ASSIGN_OR_RETURN(const DirectionCone cone, MinimumCone(lines));
  envelope.first_mm = a.radius;
  envelope.second_mm = b.radius;
  envelope.cone_rad = cone.FullAngleRad();
  envelope.iso_mm = std::max(IsoRepeatability(first), IsoRepeatability(second));
  return envelope;
}

}  // namespace forgescan
