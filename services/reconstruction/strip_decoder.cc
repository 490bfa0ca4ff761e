#include "services/reconstruction/strip_decoder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/fringe_decoder.h"

namespace forgescan {
namespace {

constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;
constexpr float kTinyDn = 1e-6f;  // keeps a division by the modulation finite; such pixels are masked

template <typename Pixel>
void LoadLane(const cv::Mat& frame, int row, int column, std::span<float> lane, float scale) {
  const Pixel* source = frame.ptr<Pixel>(row) + column;
  for (std::size_t x = 0; x < lane.size(); ++x) {
    lane[x] = scale * static_cast<float>(source[x]);
  }
}

// Without a branch, so that loops over it vectorise.
inline void Mark(std::int32_t& slot, bool applies, MaskCause cause) {
  slot = applies ? static_cast<std::int32_t>(cause) : slot;
}

// The nearest whole number, for |value| < 4000; truncation of a positive number vectorises everywhere.
inline float Nearest(float value) {
  return static_cast<float>(static_cast<std::int32_t>(value + 4096.5f) - 4096);
}

}  // namespace

StripDecoder::StripDecoder(const PatternSet& pattern, const ReconstructionConfig& config,
                           const PhaseEstimator& estimator, const FringeOrderTable& table)
    : pattern_(pattern), table_(table), config_(config) {
  const int frames = pattern.frame_count();
  frames_.resize(static_cast<std::size_t>(frames));
  terms_.resize(static_cast<std::size_t>(frames));
  reference_noise_ = static_cast<float>(estimator.ReferenceNoise(0, pattern.ReferencePerModulation()));
  models_drift_ = estimator.drift.has_value();
  constexpr double kZero = 1e-12;  // weights that are 0 but for rounding
  for (int j = 0; j < static_cast<int>(pattern.frequencies.size()); ++j) {
    const auto at = static_cast<std::size_t>(j);
    period_px_[at] = static_cast<float>(pattern.frequencies[at].period_px);
    fusion_[at] = static_cast<float>(estimator.fusion[at]);
    phase_noise_[at] = static_cast<float>(estimator.PhaseNoise(j));
    auto& weights = weights_.emplace_back();
    const double px_per_rad =
        estimator.fusion[at] * pattern.frequencies[at].period_px / (2 * std::numbers::pi);
    for (int i = 0; i < frames; ++i) {
      const double c = estimator.cosine(j, i), s = estimator.sine(j, i), a = estimator.background(j, i);
      const auto frame = static_cast<std::size_t>(i);
      if (std::abs(c) + std::abs(s) + std::abs(a) > kZero) {
        weights.push_back({frame, static_cast<float>(c), static_cast<float>(s), static_cast<float>(a)});
      }
      if (std::abs(c) + std::abs(s) > kZero) {
        terms_[frame].push_back({at, static_cast<float>(c * px_per_rad), static_cast<float>(s * px_per_rad)});
      }
    }
  }
}

void StripDecoder::Load(std::span<const cv::Mat> frames, int row, int column, int length) {
  length_ = length;
  std::fill_n(peak_.begin(), length, 0.0f);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto scale = static_cast<float>(GreyScale(frames[i], config_));
    const std::span<float> lane(frames_[i].data(), static_cast<std::size_t>(length));
    if (frames[i].depth() == CV_8U) {
      LoadLane<std::uint8_t>(frames[i], row, column, lane, scale);
    } else {
      LoadLane<std::uint16_t>(frames[i], row, column, lane, scale);
    }
    if (pattern_.reference_frame_index == static_cast<int>(i) && !models_drift_) {
      continue;  // plain white may saturate without harm to the phases; its own check follows
    }
    for (int x = 0; x < length; ++x) {
      const auto at = static_cast<std::size_t>(x);
      peak_[at] = std::max(peak_[at], lane[at]);
    }
  }
}

void StripDecoder::Decode() {
  for (std::size_t j = 0; j < weights_.size(); ++j) {
    SolvePhases(j);
  }
  Unwrap();
  Fuse();
  PredictSigma();
  Classify();
}

void StripDecoder::SolvePhases(std::size_t j) {
  const int length = length_;  // a local bound, which no store through a member can change
  float* const c = cosine_[j].data();
  float* const s = sine_[j].data();
  float* const a = background_[j].data();
  float* const b = modulation_[j].data();
  float* const turns = turns_[j].data();
  std::fill_n(c, length, 0.0f);
  std::fill_n(s, length, 0.0f);
  std::fill_n(a, length, 0.0f);
  for (const Weighted& weight : weights_[j]) {
    const float* const grey = frames_[weight.frame].data();
    const float wc = weight.cosine, ws = weight.sine, wa = weight.background;  // local: see length
    for (int x = 0; x < length; ++x) {
      c[x] += wc * grey[x];
      s[x] += ws * grey[x];
      a[x] += wa * grey[x];
    }
  }
  for (int x = 0; x < length; ++x) {
    turns[x] = TurnsFromPhasor(c[x], s[x]);
    b[x] = std::sqrt(c[x] * c[x] + s[x] * s[x]) + kTinyDn;
    c[x] /= b[x];
    s[x] /= b[x];
  }
}

void StripDecoder::Unwrap() {
  const int length = length_;  // a local bound, which no store through a member can change
  const float* const base = turns_[static_cast<std::size_t>(table_.base)].data();
  const float* const other1 = turns_[static_cast<std::size_t>(table_.others[0])].data();
  const float* const other2 = turns_[static_cast<std::size_t>(table_.others[1])].data();
  const bool has_second = table_.other_count == 2;
  for (int x = 0; x < length; ++x) {
    const float r1 = other1[x] - table_.ratios[0] * base[x];
    const float r2 = has_second ? other2[x] - table_.ratios[1] * base[x] : 0.0f;
    const FringeOrderTable::Entry entry = table_.Look(r1, r2);
    order_[static_cast<std::size_t>(x)] = entry.order;
    doubtful_[static_cast<std::size_t>(x)] = entry.is_doubtful;
  }
}

void StripDecoder::Fuse() {
  const int length = length_;  // a local bound, which no store through a member can change
  const auto base = static_cast<std::size_t>(table_.base);
  const auto origin = static_cast<float>(pattern_.phase_origin_px);
  const float* const base_turns = turns_[base].data();
  for (int x = 0; x < length; ++x) {
    const auto at = static_cast<std::size_t>(x);
    coordinate_px[at] = origin + period_px_[base] * (order_[at] + base_turns[at]);
    disagreement_rad[at] = 0;
  }
  for (int o = 0; o < table_.other_count; ++o) {
    const auto j = static_cast<std::size_t>(table_.others[static_cast<std::size_t>(o)]);
    const float ratio = table_.ratios[static_cast<std::size_t>(o)];
    const float gain_px = fusion_[j] * period_px_[j];
    const float* const turns = turns_[j].data();
    for (int x = 0; x < length; ++x) {
      const auto at = static_cast<std::size_t>(x);
      const float predicted =
          (order_[at] + base_turns[at]) * ratio - turns[at];  // fringe order of j, not yet whole
      const float off_turns = predicted - Nearest(predicted);
      coordinate_px[at] -= gain_px * off_turns;
      disagreement_rad[at] += off_turns * off_turns;
    }
  }
  const float scale = 1.0f / static_cast<float>(table_.other_count);
  for (int x = 0; x < length; ++x) {
    const auto at = static_cast<std::size_t>(x);
    disagreement_rad[at] = kTwoPi * std::sqrt(scale * disagreement_rad[at]);
  }
}

// The fused coordinate is linear in small changes n_i of the frames: dx = sum_i n_i sum_j w_j L_j / (2 pi
// B_j) (cos phi_j sine(j,i) - sin phi_j cosine(j,i)); the variances of the frames add with the squares of
// these factors.
void StripDecoder::PredictSigma() {
  const int length = length_;  // a local bound, which no store through a member can change
  const auto read_variance = static_cast<float>(config_.noise.read_noise_dn * config_.noise.read_noise_dn);
  const auto gain = static_cast<float>(config_.noise.gain_dn);
  std::array<Lane, kMaxFrequencies> c;
  std::array<Lane, kMaxFrequencies> s;
  for (std::size_t j = 0; j < weights_.size(); ++j) {
    for (std::size_t x = 0; x < static_cast<std::size_t>(length); ++x) {
      c[j][x] = cosine_[j][x] / modulation_[j][x];
      s[j][x] = sine_[j][x] / modulation_[j][x];
    }
  }
  std::fill_n(sigma_px.begin(), length, 0.0f);
  Lane factor;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    std::fill_n(factor.begin(), length, 0.0f);
    for (const FrameTerm& term : terms_[i]) {
      const float* const cj = c[term.frequency].data();
      const float* const sj = s[term.frequency].data();
      for (int x = 0; x < length; ++x) {
        factor[static_cast<std::size_t>(x)] += cj[x] * term.sine - sj[x] * term.cosine;
      }
    }
    for (std::size_t x = 0; x < static_cast<std::size_t>(length); ++x) {
      sigma_px[x] += (read_variance + gain * frames_[i][x]) * factor[x] * factor[x];
    }
  }
  for (std::size_t x = 0; x < static_cast<std::size_t>(length); ++x) {
    sigma_px[x] = std::sqrt(sigma_px[x]);
  }
}

void StripDecoder::Classify() {
  const int length = length_;  // a local bound, which no store through a member can change
  constexpr double kFullScaleDn = 255;
  const auto saturation_dn = static_cast<float>(config_.saturation_fraction * kFullScaleDn);
  const auto min_dn = static_cast<float>(config_.min_modulation_dn);
  const auto max_phase_sigma = static_cast<float>(config_.max_phase_sigma_rad);
  const auto min_sigmas = static_cast<float>(config_.min_modulation_sigma);
  const auto read_variance = static_cast<float>(config_.noise.read_noise_dn * config_.noise.read_noise_dn);
  const auto gain = static_cast<float>(config_.noise.gain_dn);
  for (std::size_t x = 0; x < static_cast<std::size_t>(length); ++x) {
    float least = modulation_[0][x];
    float level = background_[0][x];
    float worst = phase_noise_[0] / modulation_[0][x];
    for (std::size_t j = 1; j < weights_.size(); ++j) {
      least = std::min(least, modulation_[j][x]);
      level = std::max(level, background_[j][x]);
      worst = std::max(worst, phase_noise_[j] / modulation_[j][x]);
    }
    modulation_dn[x] = least;
    grey_sigma_[x] = std::sqrt(read_variance + gain * std::max(level, 0.0f));
    phase_sigma_rad[x] = grey_sigma_[x] * worst;
    cause[x] = static_cast<std::int32_t>(MaskCause::kValid);
  }
  const auto max_disagreement = static_cast<float>(config_.max_pixel_disagreement_rad);
  for (int x = 0; x < length;
       ++x) {  // the last cause to be written wins: the order is that of MaskCause, backwards
    const auto at = static_cast<std::size_t>(x);
    Mark(cause[at], disagreement_rad[at] > max_disagreement, MaskCause::kDisagreement);
    Mark(cause[at], doubtful_[at] != 0, MaskCause::kUnwrapMargin);
    Mark(cause[at], !(coordinate_px[at] >= table_.first_px && coordinate_px[at] <= table_.last_px),
         MaskCause::kOutOfRange);
  }
  ClassifyReference();
  ClassifyRatios();
  for (int x = 0; x < length; ++x) {
    const auto at = static_cast<std::size_t>(x);
    Mark(cause[at], phase_sigma_rad[at] > max_phase_sigma, MaskCause::kNoisy);
    Mark(cause[at], modulation_dn[at] < min_dn || modulation_dn[at] < min_sigmas * grey_sigma_[at],
         MaskCause::kLowModulation);
    Mark(cause[at], peak_[at] >= saturation_dn, MaskCause::kSaturated);
  }
}

void StripDecoder::ClassifyRatios() {
  const int length = length_;   // a local bound, which no store through a member can change
  constexpr float kSigmas = 5;  // a ratio of two noisy modulations may be off by its own noise as well
  for (std::size_t j = 1; j < weights_.size(); ++j) {
    const auto expected = static_cast<float>(pattern_.frequencies[j].modulation_ratio /
                                             pattern_.frequencies[0].modulation_ratio);
    const auto relative = static_cast<float>(config_.modulation_ratio_tolerance);
    for (int x = 0; x < length; ++x) {
      const auto at = static_cast<std::size_t>(x);
      const float wanted = expected * modulation_[0][at];
      const float off = std::abs(modulation_[j][at] - wanted);
      Mark(cause[at], off > relative * wanted + kSigmas * grey_sigma_[at], MaskCause::kModulationRatio);
    }
  }
}

void StripDecoder::ClassifyReference() {
  const int length = length_;  // a local bound, which no store through a member can change
  if (!pattern_.reference_frame_index || models_drift_) {
    return;
  }
  const Lane& white = frames_[static_cast<std::size_t>(*pattern_.reference_frame_index)];
  const auto per_modulation = static_cast<float>(pattern_.ReferencePerModulation());
  const auto sigmas = static_cast<float>(config_.reference_tolerance_sigma);
  const auto part = static_cast<float>(config_.reference_tolerance_modulation);
  const auto read_variance = static_cast<float>(config_.noise.read_noise_dn * config_.noise.read_noise_dn);
  const auto gain = static_cast<float>(config_.noise.gain_dn);
  for (int x = 0; x < length; ++x) {
    const auto at = static_cast<std::size_t>(x);
    const float wanted = std::min(background_[0][at] + per_modulation * modulation_[0][at], 255.0f);
    const float wanted_sigma = reference_noise_ * grey_sigma_[at];
    const float variance = wanted_sigma * wanted_sigma + read_variance + gain * std::max(wanted, 0.0f);
    const float limit = std::max(sigmas * std::sqrt(variance), part * modulation_[0][at]);
    Mark(cause[at], std::abs(white[at] - wanted) > limit, MaskCause::kReference);
  }
}

}  // namespace forgescan
