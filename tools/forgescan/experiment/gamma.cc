// What a projector that is not linear does to both sets, without and with linearisation.
#include <array>
#include <cmath>
#include <numbers>

#include "services/reconstruction/fringe_decoder.h"
#include "services/reconstruction/trust.h"
#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/experiment/experiment.h"
#include "tools/forgescan/experiment/synthetic_frames.h"

namespace forgescan {
namespace {

constexpr int kPhases = 120;               // a turn; the errors are smooth
constexpr int kResponseLevels = 33;        // measured for the linearisation
constexpr double kResponseNoise = 0.0005;  // of each, fraction of white: mean of many pixels and frames

// Light for a commanded level; both fractions of white.
class Projector {
 public:
  Projector(double gamma, bool is_linearised, std::uint64_t seed) : gamma_(gamma) {
    if (!is_linearised) return;
    RandomStream random = DrawsOf(seed, Draw::kResponse);
    for (int i = 0; i < kResponseLevels; ++i) {
      const double level = static_cast<double>(i) / (kResponseLevels - 1);
      measured_.push_back(std::pow(level, gamma_) + kResponseNoise * random.Gaussian());
    }
  }

  double Emitted(double level) const {
    return std::pow(measured_.empty() ? level : CommandFor(level), gamma_);
  }

 private:
  // The command that the measured response says gives this light, linear between its points.
  double CommandFor(double light) const {
    std::size_t i = 1;
    while (i + 1 < measured_.size() && measured_[i] < light) ++i;
    const double share = (light - measured_[i - 1]) / (measured_[i] - measured_[i - 1]);
    return std::clamp((static_cast<double>(i - 1) + share) / (kResponseLevels - 1), 0.0, 1.0);
  }

  double gamma_;
  std::vector<double> measured_;
};

// First and second harmonic of what is emitted for a sinusoid: the truth. Returns B2 / B1.
double SecondHarmonic(const Projector& projector) {
  constexpr int kSamples = 720;
  double first = 0, second = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double phase = 2 * std::numbers::pi * i / kSamples;
    const double light = projector.Emitted(0.5 + 0.45 * std::cos(phase));
    first += light * std::cos(phase);
    second += light * std::cos(2 * phase);
  }
  return std::abs(second / first);
}

// Largest error of any phase over all phases of its own and of the first frequency, whose frames carry the
// shared background.
double WorstPhaseError(const PatternSet& pattern, const PhaseEstimator& estimator,
                       const Projector& projector) {
  double worst = 0;
  Eigen::VectorXd grey(pattern.frame_count());
  const auto set = [&](std::size_t j, double phase) {
    const FringeFrequency& frequency = pattern.frequencies[j];
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      grey[frequency.frame_index[i]] =
          projector.Emitted(0.5 + 0.45 * std::cos(phase + frequency.shift_rad[i]));
    }
  };
  const auto error = [&](Eigen::Index j, double phase) {
    return std::abs(
        Wrapped(std::atan2(estimator.sine.row(j).dot(grey), estimator.cosine.row(j).dot(grey)) - phase));
  };
  for (int first = 0; first < kPhases; ++first) {
    const double first_phase = 2 * std::numbers::pi * first / kPhases;
    set(0, first_phase);
    for (int other = 0; other < kPhases; ++other) {
      const double phase = 2 * std::numbers::pi * other / kPhases;
      set(1, phase);
      set(2, phase);
      worst = std::max({worst, error(0, first_phase), error(1, phase), error(2, phase)});
    }
  }
  return worst;
}

struct Trusted {
  std::optional<double> second_harmonic;  // measured
  bool is_refused = false;
};

// What the reconstruction's own check says of frames with a little noise.
Result<Trusted> AskTrust(const PatternSet& pattern, const Projector& projector, std::uint64_t seed) {
  RampScene scene{.noise_dn = 0.9, .seed = seed};  // sigma / B = 0.01
  scene.emitted = [&projector](double level) { return projector.Emitted(level); };
  ReconstructionConfig config;
  config.noise = {scene.noise_dn, 0};
  ASSIGN_OR_RETURN(const auto decoder, FringeDecoder::Create(pattern, config));
  const std::vector<cv::Mat> frames = RampFrames(pattern, scene);
  ASSIGN_OR_RETURN(const DecodedView view, decoder.Decode(frames));
  ASSIGN_OR_RETURN(const TrustFigures figures, MeasureTrust(frames, view, decoder, config));
  return Trusted{figures.second_harmonic_ratio, !JudgeTrust(figures, decoder, config, "ramp").ok()};
}

struct Sets {
  PatternSet full = SyntheticPattern(Background::kOwn), reduced = SyntheticPattern(Background::kShared);
  PhaseEstimator full_estimator, reduced_estimator;
};

// Errors by gamma: full, reduced, full linearised, reduced linearised.
using Errors = std::array<std::vector<double>, 4>;

Result<Errors> MeasureErrors(const std::vector<double>& gammas, const Sets& sets, std::uint64_t seed) {
  Errors errors;
  for (const double gamma : gammas) {
    for (const bool is_linearised : {false, true}) {
      const Projector projector(gamma, is_linearised, seed);
      const std::size_t first = is_linearised ? 2 : 0;
      errors[first].push_back(WorstPhaseError(sets.full, sets.full_estimator, projector));
      errors[first + 1].push_back(WorstPhaseError(sets.reduced, sets.reduced_estimator, projector));
    }
  }
  return errors;
}

Result<Table> ErrorTable(const std::vector<double>& gammas, const Errors& errors, const Sets& sets,
                         std::uint64_t seed) {
  Table table{{"gamma", "B2/B true", "B2/B by the full set", "full", "reduced", "full, linearised",
               "reduced, linearised", "reduced set refused"},
              {}};
  for (std::size_t i = 0; i < gammas.size(); ++i) {
    const Projector projector(gammas[i], false, seed);
    ASSIGN_OR_RETURN(const Trusted full, AskTrust(sets.full, projector, seed));
    ASSIGN_OR_RETURN(const Trusted reduced, AskTrust(sets.reduced, projector, seed));
    table.rows.push_back({fmt::format("{:.2f}", gammas[i]), fmt::format("{:.4f}", SecondHarmonic(projector)),
                          full.second_harmonic ? fmt::format("{:.4f}", *full.second_harmonic) : "none",
                          fmt::format("{:.4f}", errors[0][i]), fmt::format("{:.4f}", errors[1][i]),
                          fmt::format("{:.4f}", errors[2][i]), fmt::format("{:.4f}", errors[3][i]),
                          reduced.is_refused ? "yes" : "no"});
  }
  return table;
}

}  // namespace

Result<ExperimentReport> RunGamma(const ExperimentOptions& options) {
  Sets sets;
  ASSIGN_OR_RETURN(sets.full_estimator, MakePhaseEstimator(sets.full));
  ASSIGN_OR_RETURN(sets.reduced_estimator, MakePhaseEstimator(sets.reduced));
  std::vector<double> gammas;
  for (int i = 0; i <= options.runs; ++i) gammas.push_back(1 + 0.1 * i / options.runs);
  ASSIGN_OR_RETURN(const Errors errors, MeasureErrors(gammas, sets, options.seed));
  ExperimentReport report;
  report.question = fmt::format(
      "A projector emits level^gamma for a commanded sinusoid of 0.05 to 0.95 of white. Largest error of any "
      "phase, rad, without noise; with linearisation by a response measured at {} levels with {} of white "
      "noise each. True 2nd harmonic: by Fourier sums over the emitted light. The last column is the "
      "reconstruction's own check of a ramp with sigma/B 0.01.",
      kResponseLevels, kResponseNoise);
  ASSIGN_OR_RETURN(Table table, ErrorTable(gammas, errors, sets, options.seed));
  report.tables.push_back(std::move(table));
  const std::size_t middle = gammas.size() / 2;
  report.goals.push_back({fmt::format("error of the reduced set at gamma {:.2f}, linearised", gammas[middle]),
                          errors[3][middle], 0.005, "rad"});
  report.goals.push_back({"the same without: enough to be detected", errors[1][middle], 0.02, "rad", true});
  Chart chart{"Largest phase error by projector gamma", {"gamma"}, {"phase error, rad", false, 0.0}, {}, {}};
  const char* names[] = {"full", "reduced", "full, linearised", "reduced, linearised"};
  for (std::size_t i = 0; i < 4; ++i) {
    const int colour = i % 2 == 0 ? 2 : 1;
    chart.series.push_back({names[i], i < 2 ? Mark::kLineDots : Mark::kDashed, gammas, errors[i], colour});
  }
  chart.goals = {{0.005, "goal with linearisation"}, {0.02, "to be detected"}};
  report.svg = SvgFile("gamma", 900, 440, DrawChart(chart, {0, 0, 900, 440}));
  report.remarks.emplace_back(
      "Both cameras see the same pattern: an error that depends on the phase alone moves a surface point's "
      "phase equally in both, so it does not shift the points of the stereo pair; it weakens fringe orders "
      "and the projector check.");
  return report;
}

}  // namespace forgescan
