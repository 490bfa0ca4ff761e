#include "services/registration/icp_stages.h"

#include <algorithm>
#include <cmath>

#include "services/registration/correspondences.h"

namespace forgescan {
namespace {

constexpr int kStillSteps = 3;            // motions below the limit in a row that end the fine stage
constexpr double kCoarseStopShare = 0.1;  // of the threshold's floor: a motion below is a rest
// While pairs still change, a direction may be badly seen for a moment: the coarse stage holds it, the fine
// stage stops only at a fraction of the eigenvalue that the result must have.
constexpr double kCoarseDamping = 1e-3;
constexpr double kAnything = -1;    // no eigenvalue is too small
constexpr double kFloorFall = 0.4;  // of the coarse stage's threshold floor, each time the pose has settled
constexpr double kPassingShare = 0.1;
constexpr double kSettledShare = 0.1;   // a motion below this share of the biweight's width lets it narrow,
constexpr double kNarrowing = 0.6;      // to this share of itself
constexpr double kLeastLeverMm = 1e-3;  // of a flat or straight model

double FloorOf(const RegistrationModel& model, const IcpOptions& options) {
  return std::max(options.threshold_floor_mm, model.spacing_mm());
}

// Returns how far the step moved the far end or the centre, mm.
double Move(const PoseStep& step, AlignState& state) {
  state.model_from_scan = step.moved_from_before * state.model_from_scan;
  ++state.iterations;
  return std::max(step.rotation_mm, step.translation_mm);
}

}  // namespace

StepFrame FrameOf(const RegistrationModel& model) {
  const Eigen::Vector3d half = 0.5 * (model.box_high() - model.box_low());
  // A flat or straight model still needs a lever to scale with.
  const auto across = [&](int i, int j) { return std::max(std::hypot(half[i], half[j]), kLeastLeverMm); };
  return {model.center(), {across(1, 2), across(2, 0), across(0, 1)}};
}

Result<AlignState> AlignCoarse(const ScanSample& sample, const RegistrationModel& model,
                               const IcpOptions& options, AlignState state) {
  const double last_floor_mm = FloorOf(model, options);
  double floor_mm = std::max(last_floor_mm, std::min(state.gate_mm, options.start_translation_mm));
  for (int i = 0; i < options.max_iterations; ++i) {
    std::vector<Pair> pairs = PairRoughly(sample, model, state.model_from_scan, options);
    state.gate_mm = AdaptiveThreshold(pairs, state.gate_mm, floor_mm, options.threshold_sigmas);
    WeighByDistance(pairs, state.gate_mm);
    ASSIGN_OR_RETURN(const PoseStep step,
                     SolveStep(pairs, FrameOf(model), {kAnything, kCoarseDamping, options.threads}));
    const double motion_mm = Move(step, state);
    if (motion_mm > kCoarseStopShare * floor_mm) continue;
    if (floor_mm <= last_floor_mm) break;
    floor_mm = std::max(last_floor_mm, kFloorFall * floor_mm);
  }
  return state;
}

FineState BeginFine(const RegistrationModel& model, const IcpOptions& options, const AlignState& coarse) {
  FineState state{coarse, 2 * FloorOf(model, options)};
  state.align.gate_mm = state.least_cut_mm;
  return state;
}

Result<FineState> AlignFine(const ScanSample& sample, const RegistrationModel& model,
                            const IcpOptions& options, double stop_mm, FineState state) {
  int still = 0;
  for (int i = 0; i < options.max_iterations && still < kStillSteps; ++i) {
    std::vector<Pair> pairs =
        PairWithSurface(sample, model, state.align.model_from_scan, state.align.gate_mm, options);
    state.align.gate_mm =
        AdaptiveThreshold(pairs, state.align.gate_mm, options.threshold_floor_mm, options.threshold_sigmas);
    const WeighedPairs weighed = WeighBiweight(pairs, state.align.gate_mm, state.least_cut_mm);
    ASSIGN_OR_RETURN(
        const PoseStep step,
        SolveStep(pairs, FrameOf(model), {kPassingShare * options.min_eigenvalue, 0, options.threads}));
    const double motion_mm = Move(step, state.align);
    const bool narrow = weighed.cut_mm > state.least_cut_mm;
    still = narrow && motion_mm < stop_mm ? still + 1 : 0;
    if (motion_mm < kSettledShare * state.least_cut_mm) state.least_cut_mm *= kNarrowing;
  }
  state.at_rest = still >= kStillSteps;
  return state;
}

}  // namespace forgescan
