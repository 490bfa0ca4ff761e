#include "services/reconstruction/frequency_agreement.h"

#include <array>
#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

double TurnsOf(const std::complex<double>& phasor) { return std::arg(phasor) / (2 * std::numbers::pi); }

// Position of a pixel in fringes of the finest frequency, by the table of orders.
double FringeOf(const FringeOrderTable& table, const std::vector<std::complex<double>>& phasors,
                double turns) {
  const double begin = turns - std::floor(turns);
  std::array<float, 2> differences{};
  for (std::size_t o = 0; o < static_cast<std::size_t>(table.other_count); ++o) {
    const double other = TurnsOf(phasors[static_cast<std::size_t>(table.others[o])]);
    differences[o] = static_cast<float>(other - static_cast<double>(table.ratios[o]) * begin);
  }
  return table.Look(differences[0], differences[1]).order + begin;
}

// Phase errors of the frequencies by a change of the frames (first order).
Eigen::VectorXd PhaseErrors(const PhaseEstimator& estimator, const std::vector<std::complex<double>>& phasors,
                            const Eigen::VectorXd& change) {
  Eigen::VectorXd errors(static_cast<Eigen::Index>(phasors.size()));
  for (Eigen::Index j = 0; j < errors.size(); ++j) {
    const std::complex<double> p = phasors[static_cast<std::size_t>(j)];
    const double dc = estimator.cosine.row(j).dot(change), ds = estimator.sine.row(j).dot(change);
    errors(j) = (p.real() * ds - p.imag() * dc) / std::norm(p);
  }
  return errors;
}

}  // namespace

Eigen::MatrixX2d HarmonicFrames(const PatternSet& pattern, const std::vector<std::complex<double>>& phasors) {
  Eigen::MatrixX2d frames = Eigen::MatrixX2d::Zero(pattern.frame_count(), 2);
  for (std::size_t j = 0; j < phasors.size(); ++j) {
    const FringeFrequency& frequency = pattern.frequencies[j];
    const double modulation = std::abs(phasors[j]);
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      const double angle = 2 * (std::arg(phasors[j]) + frequency.shift_rad[i]);
      frames(frequency.frame_index[i], 0) = modulation * std::cos(angle);
      frames(frequency.frame_index[i], 1) = -modulation * std::sin(angle);
    }
  }
  return frames;
}

double SquaredDisagreement(const FringeOrderTable& table, const Eigen::VectorXd& errors) {
  double sum = 0;
  for (int o = 0; o < table.other_count; ++o) {
    const auto at = static_cast<std::size_t>(o);
    const double off = static_cast<double>(table.ratios[at]) * errors(table.base) - errors(table.others[at]);
    sum += off * off;
  }
  return sum / table.other_count;
}

double DisagreementRad(const FringeDecoder& decoder, const std::vector<std::complex<double>>& phasors,
                       double coordinate_px) {
  const FringeOrderTable& table = decoder.table();
  const auto base = static_cast<std::size_t>(table.base);
  const double turns = TurnsOf(phasors[base]);
  const double position =
      (coordinate_px - decoder.pattern().phase_origin_px) / decoder.pattern().frequencies[base].period_px;
  const double unwrapped =
      std::isnan(position) ? FringeOf(table, phasors, turns) : std::round(position - turns) + turns;
  double sum = 0;
  for (std::size_t o = 0; o < static_cast<std::size_t>(table.other_count); ++o) {
    const double off = static_cast<double>(table.ratios[o]) * unwrapped -
                       TurnsOf(phasors[static_cast<std::size_t>(table.others[o])]);
    sum += std::pow(off - std::round(off), 2);
  }
  return 2 * std::numbers::pi * std::sqrt(sum / table.other_count);
}

double HarmonicGain(const FringeDecoder& decoder) {
  constexpr int kSteps = 8;
  const auto count = decoder.pattern().frequencies.size();
  double sum = 0;
  int cases = 0;
  for (int a = 0; a < kSteps; ++a) {
    for (int b = 0; b < kSteps; ++b) {
      for (int c = 0; c < kSteps; ++c) {
        std::vector<std::complex<double>> phasors;
        for (const int step : {a, b, c}) {
          phasors.push_back(std::polar(1.0, 2 * std::numbers::pi * (step + 0.25) / kSteps));
        }
        phasors.resize(count);
        const Eigen::VectorXd change = HarmonicFrames(decoder.pattern(), phasors).col(0);
        sum += SquaredDisagreement(decoder.table(), PhaseErrors(decoder.estimator(), phasors, change));
        ++cases;
      }
    }
  }
  return std::sqrt(sum / cases);
}

}  // namespace forgescan
