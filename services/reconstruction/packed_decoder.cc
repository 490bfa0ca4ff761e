#include "services/reconstruction/packed_decoder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kTurn = 65536;  // steps of a phase
constexpr double kPerDn = 64;    // steps of a modulation
constexpr double kVariance = kPerDn * kPerDn;

std::uint16_t Steps(double value, double one) {
  return static_cast<std::uint16_t>(std::clamp(std::round(value * one), 0.0, 65535.0));
}

bool IsNear(double value, double wanted) { return std::abs(value - wanted) < 1e-9; }

// The slots' frequencies: the one with three frames first.
std::optional<std::array<std::size_t, 3>> FindSlots(const PatternSet& pattern) {
  const auto& frequencies = pattern.frequencies;
  if (frequencies.size() != 3 || pattern.background != Background::kShared) {
    return std::nullopt;
  }
  std::array<std::size_t, 3> slots = {0, 1, 2};
  std::stable_sort(slots.begin(), slots.end(), [&](std::size_t a, std::size_t b) {
    return frequencies[a].frame_index.size() > frequencies[b].frame_index.size();
  });
  const auto frames = [&](std::size_t slot) { return frequencies[slots[slot]].frame_index.size(); };
  return frames(0) == 3 && frames(1) == 2 && frames(2) == 2 ? std::optional(slots) : std::nullopt;
}

// Whether the least-squares solution is Eq. (4).
bool IsEquation4(const PatternSet& pattern, const PhaseEstimator& estimator,
                 const std::array<std::size_t, 3>& slots) {
  const auto& three = pattern.frequencies[slots[0]].frame_index;
  for (const std::size_t slot : slots) {
    const auto& own = pattern.frequencies[slot].frame_index;
    const auto j = static_cast<Eigen::Index>(slot);
    Eigen::RowVectorXd c = Eigen::RowVectorXd::Zero(pattern.frame_count()), s = c, a = c;
    a(three[0]) = a(three[2]) = 0.5;
    if (slot == slots[0]) {
      c(three[0]) = 0.5;
      c(three[2]) = -0.5;
    } else {
      c = -a;
      c(own[0]) += 1;
    }
    s = a;
    s(own[1]) -= 1;
    for (Eigen::Index i = 0; i < c.size(); ++i) {
      if (!IsNear(estimator.cosine(j, i), c(i)) || !IsNear(estimator.sine(j, i), s(i)) ||
          !IsNear(estimator.background(j, i), a(i))) {
        return false;
      }
    }
  }
  return true;
}

// The kernel's squares: of small numbers over 2^8, of large ones over 2^12.
constexpr double kSmall = 256;
constexpr double kLarge = 4096;

// Of a square in units of the kernel: so many variances of a grey value.
PackedLimit Limit(const ReconstructionConfig& config, double variances) {
  return {.base = Steps(variances * kVariance * std::pow(config.noise.read_noise_dn, 2), 1),
          .per_level = Steps(variances * kVariance * config.noise.gain_dn / 2, 512)};
}

// Whether so many variances of the brightest grey value are a limit below the kernel's largest square.
bool Fits(const ReconstructionConfig& config, double variances) {
  constexpr double kFullScaleDn = 255, kLargest = 60000;
  const double brightest = std::pow(config.noise.read_noise_dn, 2) + kFullScaleDn * config.noise.gain_dn;
  return variances * kVariance * brightest < kLargest &&
         variances * kVariance * config.noise.gain_dn / 2 * 512 < kLargest;
}

double RatioToFirst(const PatternSet& pattern, std::size_t frequency) {
  return pattern.frequencies[frequency].modulation_ratio / pattern.frequencies[0].modulation_ratio;
}

bool IsInRange(const PackedDecoder::Set& set) {
  const bool ratios_fit = std::ranges::all_of(std::array<std::size_t, 3>{0, 1, 2}, [&](std::size_t j) {
    return RatioToFirst(set.pattern, j) > 0.5 && RatioToFirst(set.pattern, j) < 1.9;
  });
  double least_noise = 100;
  for (int j = 0; j < 3; ++j) {
    least_noise = std::min(least_noise, set.estimator.PhaseNoise(j));
  }
  const ReconstructionConfig& config = set.config;
  const double reference_noise = set.estimator.ReferenceNoise(0, set.pattern.ReferencePerModulation());
  const bool limits_fit =
      Fits(config, std::pow(config.min_modulation_sigma, 2) / kSmall) && Fits(config, 25 / kSmall) &&
      Fits(config, std::pow(least_noise / config.max_phase_sigma_rad, 2) / kLarge) &&
      Fits(config,
           std::pow(config.reference_tolerance_sigma, 2) * (reference_noise * reference_noise + 1) / kSmall);
  return ratios_fit && limits_fit && set.pattern.reference_contrast > 0.51 &&
         set.config.modulation_ratio_tolerance < 1 && set.config.reference_tolerance_modulation < 1;
}

}  // namespace

std::optional<PackedDecoder> PackedDecoder::Make(const Set& set, SimdPath path) {
  const auto slots = FindSlots(set.pattern);
  if (!slots || !IsEquation4(set.pattern, set.estimator, *slots) || !IsInRange(set)) {
    return std::nullopt;
  }
  PackedDecoder decoder(path);
  decoder.frequency_ = *slots;
  std::size_t next = 0;
  for (const std::size_t frequency : *slots) {
    for (const int frame : set.pattern.frequencies[frequency].frame_index) {
      decoder.frame_[next++] = static_cast<std::size_t>(frame);
    }
  }
  decoder.SetOrders(set);
  decoder.SetMasks(set);
  decoder.SetReference(set);
  decoder.SetSigma(set);
  return decoder;
}

void PackedDecoder::SetOrders(const Set& set) {
  const FringeOrderTable& table = set.table;
  const auto slot_of = [&](int frequency) {
    return static_cast<int>(std::ranges::find(frequency_, static_cast<std::size_t>(frequency)) -
                            frequency_.begin());
  };
  constants_.slot = {slot_of(table.base), slot_of(table.others[0]), slot_of(table.others[1])};
  constants_.first_slot = slot_of(0);
  const int first = std::ranges::min(table.cells, {}, &FringeOrderTable::Entry::order).order;
  for (const FringeOrderTable::Entry& entry : table.cells) {
    cells_.push_back(static_cast<std::uint32_t>(entry.order - first) |
                     (entry.is_doubtful != 0 ? 0x8000U : 0U));
  }
  const double period_px = set.pattern.frequencies[static_cast<std::size_t>(table.base)].period_px;
  for (std::size_t o = 0; o < 2; ++o) {
    const auto other = static_cast<std::size_t>(table.others[o]);
    const double other_px = set.pattern.frequencies[other].period_px, ratio = period_px / other_px;
    const double code = ratio * first;
    constants_.ratio_high[o] = static_cast<std::uint16_t>(ratio * kTurn);
    constants_.ratio_low[o] = static_cast<std::uint16_t>((ratio * kTurn - std::floor(ratio * kTurn)) * kTurn);
    constants_.first_turns[o] = static_cast<std::uint16_t>(std::lround((code - std::floor(code)) * kTurn));
    constants_.gain_px[o] = static_cast<float>(set.estimator.fusion[other] * other_px / kTurn);
  }
  constants_.period_px = static_cast<float>(period_px / kTurn);
  constants_.first_order_px = static_cast<float>(set.pattern.phase_origin_px + first * period_px);
  const double limit = std::min(set.config.max_pixel_disagreement_rad, 4.0) / kTwoPi * kTurn;
  constants_.max_disagreement =
      Steps(2 * limit * limit / 32768, 1);  // of at most two half turns, which never exceed it
  constants_.first_px = table.first_px;
  constants_.last_px = table.last_px;
}

void PackedDecoder::SetMasks(const Set& set) {
  const ReconstructionConfig& config = set.config;
  constexpr double kRatioSigmas = 5;  // as StripDecoder
  constants_.min_modulation = Steps(config.min_modulation_dn, kPerDn);
  constants_.low_limit = Limit(config, std::pow(config.min_modulation_sigma, 2) / kSmall);
  constants_.ratio_limit = Limit(config, kRatioSigmas * kRatioSigmas / kSmall);
  constants_.ratio_tolerance = Steps(config.modulation_ratio_tolerance, kTurn);
  double least_noise = 100;
  for (const std::size_t frequency : frequency_) {
    least_noise = std::min(least_noise, set.estimator.PhaseNoise(static_cast<int>(frequency)));
  }
  constants_.noise_limit = Limit(config, std::pow(least_noise / config.max_phase_sigma_rad, 2) / kLarge);
  for (std::size_t slot = 0; slot < 3; ++slot) {
    const double noise = set.estimator.PhaseNoise(static_cast<int>(frequency_[slot]));
    constants_.quietness[slot] = Steps(least_noise / noise, kTurn);
    constants_.ratio[slot] = Steps(RatioToFirst(set.pattern, frequency_[slot]), 32768);
    constants_.mean_ratio[slot] = Steps(1 / (3 * RatioToFirst(set.pattern, frequency_[slot])), kTurn);
  }
}

void PackedDecoder::SetReference(const Set& set) {
  constants_.has_reference = set.pattern.reference_frame_index.has_value();
  if (!constants_.has_reference) {
    return;
  }
  frame_[7] = static_cast<std::size_t>(*set.pattern.reference_frame_index);
  const double noise = std::pow(set.estimator.ReferenceNoise(0, set.pattern.ReferencePerModulation()), 2);
  const double limit = std::pow(set.config.reference_tolerance_sigma, 2) * kVariance;
  const double read = std::pow(set.config.noise.read_noise_dn, 2), gain = set.config.noise.gain_dn;
  constants_.reference_per_modulation = Steps(set.pattern.ReferencePerModulation(), 32768);
  constants_.reference_tolerance = Steps(set.config.reference_tolerance_modulation, kTurn);
  constants_.white_limit = {.base = Steps(limit * read * (noise + 1) / kSmall, 1),
                            .per_level = Steps(limit * noise * gain / 2 / kSmall, 512)};
  constants_.white_limit_per_white = Steps(limit * gain / kPerDn / kSmall, 16384);
}

void PackedDecoder::SetSigma(const Set& set) {
  constexpr double kHeadroom = 1.5;  // over the largest sum of influences, sqrt(2)
  std::array<double, 3> influence_px{};
  double sum_px = 0;
  for (std::size_t slot = 0; slot < 3; ++slot) {
    const std::size_t j = frequency_[slot];
    influence_px[slot] = set.estimator.fusion[j] * set.pattern.frequencies[j].period_px / kTwoPi /
                         RatioToFirst(set.pattern, j);
    sum_px += kHeadroom * influence_px[slot];
  }
  for (std::size_t slot = 0; slot < 3; ++slot) {
    constants_.influence[slot] = static_cast<std::int16_t>(std::lround(32768 * influence_px[slot] / sum_px));
  }
  constants_.read_variance = static_cast<float>(std::pow(set.config.noise.read_noise_dn, 2));
  constants_.lit_variance = static_cast<float>(256 * set.config.noise.gain_dn);
  constants_.sigma_scale_px = static_cast<float>(sum_px * kPerDn / std::sqrt(kTurn));
}

bool PackedDecoder::Row(std::span<const cv::Mat> frames, int row, int saturation_dn,
                        DecodedView& view) const {
  PackedConstants constants = constants_;
  constants.cells = cells_.data();
  constants.saturation_dn = static_cast<std::uint8_t>(std::min(saturation_dn, 255));
  const int width = view.cause.cols;
  const int strips = (width + PackedKernel::kMaxLength - 1) / PackedKernel::kMaxLength;
  PackedStrip strip;
  strip.length = std::min(((width + strips - 1) / strips + 31) / 32 * 32, width / 32 * 32);
  bool doubts = false;
  for (int begin = 0; begin < width; begin += strip.length) {
    const int column = std::min(begin, width - strip.length);  // the last strip does some pixels again
    for (std::size_t i = 0; i < 8; ++i) {
      strip.frames[i] = i < 7 || constants.has_reference ? frames[frame_[i]].ptr(row) + column : nullptr;
    }
    strip.coordinate_px = view.coordinate_px[row] + column;
    strip.sigma_px = view.sigma_px[row] + column;
    strip.cause = view.cause[row] + column;
    doubts = kernel_.Decode(constants, strip) || doubts;
  }
  return doubts;
}

}  // namespace forgescan
