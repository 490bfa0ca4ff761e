#include "services/reconstruction/packed_decoder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/reconstruction/variance_factors.h"

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

// Variance of a grey value in units of the kernel: 15 bits, so that products may be signed ones.
double PerVariance(const CameraNoise& noise) {
  constexpr double kFullScaleDn = 255, kLargest = 32000;
  return kLargest / (noise.read_noise_dn * noise.read_noise_dn + kFullScaleDn * noise.gain_dn);
}

PackedLimit Variance(const CameraNoise& noise, double one) {
  return {.base = Steps(one * noise.read_noise_dn * noise.read_noise_dn, 1),
          .per_level = Steps(one * noise.gain_dn / 2, 512)};
}

// Of a square in units of the kernel: so many variances of a grey value.
double Limit(const ReconstructionConfig& config, double variances) {
  return variances * kVariance / PerVariance(config.noise);
}

double RatioToFirst(const PatternSet& pattern, std::size_t frequency) {
  return pattern.frequencies[frequency].modulation_ratio / pattern.frequencies[0].modulation_ratio;
}

// Orders of the table.
int OrderCount(const FringeOrderTable& table) {
  const auto [least, most] = std::ranges::minmax(table.cells, {}, &FringeOrderTable::Entry::order);
  return most.order - least.order + 1;
}

double LeastNoise(const PhaseEstimator& estimator) {
  return std::min({estimator.PhaseNoise(0), estimator.PhaseNoise(1), estimator.PhaseNoise(2)});
}

bool IsInRange(const PackedDecoder::Set& set) {
  const ReconstructionConfig& config = set.config;
  const bool ratios_fit = std::ranges::all_of(std::array<std::size_t, 3>{0, 1, 2}, [&](std::size_t j) {
    const double ratio = RatioToFirst(set.pattern, j);
    return ratio > 0.5 && ratio * (1 + config.modulation_ratio_tolerance) < 1.99;
  });
  const double reference_noise = set.estimator.ReferenceNoise(0, set.pattern.ReferencePerModulation());
  const double white =
      std::pow(config.reference_tolerance_sigma, 2) * (reference_noise * reference_noise + 1);
  const bool limits_fit = std::ranges::all_of(
      std::array{std::pow(config.min_modulation_sigma, 2) / kSmall, 25 / kSmall, white / kSmall,
                 std::pow(LeastNoise(set.estimator) / config.max_phase_sigma_rad, 2) / kLarge},
      [&](double variances) { return Limit(config, variances) < 1; });
  constexpr double kMostPerLevel = 65535.0 / 512;
  return ratios_fit && limits_fit && OrderCount(set.table) <= PackedKernel::kMaxOrders &&
         PerVariance(config.noise) * config.noise.gain_dn / 2 < kMostPerLevel &&
         set.pattern.reference_contrast > 0.51 && config.modulation_ratio_tolerance < 1 &&
         config.reference_tolerance_modulation < 1;
}

// A cell of the kernel's table from four of the table, which must agree.
std::uint8_t Cell(const FringeOrderTable& table, int first_order, std::size_t code1, std::size_t code2) {
  constexpr std::size_t kSide = FringeOrderTable::kSide;
  const auto* const upper = &table.cells[2 * code2 * kSide + 2 * code1];
  const std::array<FringeOrderTable::Entry, 4> four = {upper[0], upper[1], upper[kSide], upper[kSide + 1]};
  const bool is_sure = std::ranges::all_of(
      four, [&](const auto& entry) { return entry.is_doubtful == 0 && entry.order == four[0].order; });
  return static_cast<std::uint8_t>((four[0].order - first_order) | (is_sure ? 0 : 0x80));
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
  decoder.SetVariance(set);
  return decoder;
}

void PackedDecoder::SetOrders(const Set& set) {
  const FringeOrderTable& table = set.table;
  const auto slot_of = [&](int frequency) {
    return static_cast<std::size_t>(std::ranges::find(frequency_, static_cast<std::size_t>(frequency)) -
                                    frequency_.begin());
  };
  constants_.slot = {slot_of(table.base), slot_of(table.others[0]), slot_of(table.others[1])};
  constants_.first_slot = slot_of(0);
  const int first = std::ranges::min(table.cells, {}, &FringeOrderTable::Entry::order).order;
  cells_.resize(65536);
  for (std::size_t at = 0; at < cells_.size(); ++at) {
    const std::size_t code2 = (at >> 11 << 3) | (at >> 3 & 7), code1 = (at >> 6 & 31) << 3 | (at & 7);
    cells_[at] = Cell(table, first, code1, code2);
  }
  std::array<double, 2> gain_px{};
  const double period_px = set.pattern.frequencies[static_cast<std::size_t>(table.base)].period_px;
  for (std::size_t o = 0; o < 2; ++o) {
    const auto other = static_cast<std::size_t>(table.others[o]);
    const double other_px = set.pattern.frequencies[other].period_px, ratio = period_px / other_px;
    const double code = ratio * first;
    constants_.ratio_high[o] = static_cast<std::uint16_t>(ratio * kTurn);
    constants_.ratio_low[o] = static_cast<std::uint16_t>((ratio * kTurn - std::floor(ratio * kTurn)) * kTurn);
    constants_.first_turns[o] = static_cast<std::uint16_t>(std::lround((code - std::floor(code)) * kTurn));
    gain_px[o] = set.estimator.fusion[other] * other_px / kTurn;
  }
  const double unit_px = std::max(gain_px[0], gain_px[1]) / 32767;
  constants_.gain_px = static_cast<float>(unit_px);
  std::ranges::transform(gain_px, constants_.gain.begin(),
                         [&](double gain) { return static_cast<std::int16_t>(std::lround(gain / unit_px)); });
  constants_.period_px = static_cast<float>(period_px / kTurn);
  constants_.first_order_px = static_cast<float>(set.pattern.phase_origin_px + first * period_px);
  const double limit = std::min(set.config.max_pixel_disagreement_rad, 4.0) / kTwoPi * kTurn;
  constants_.max_disagreement = Steps(2 * limit * limit / kTurn, 1);  // two half turns never exceed it
  constants_.first_px = table.first_px;
  constants_.last_px = table.last_px;
}

void PackedDecoder::SetMasks(const Set& set) {
  const ReconstructionConfig& config = set.config;
  constexpr double kRatioSigmas = 5;  // as StripDecoder
  constants_.min_modulation = Steps(config.min_modulation_dn, kPerDn);
  const double dark_dn =
      std::numbers::sqrt2 * config.min_modulation_dn;  // 2 C and 2 S of a B below the limit
  constants_.lit_across_dn = static_cast<std::uint8_t>(std::ceil(dark_dn));
  constants_.lit_along_dn =
      static_cast<std::uint8_t>(std::max(std::ceil((dark_dn - 1) / 2), 0.0));  // its mean is rounded
  constants_.variance = Variance(config.noise, PerVariance(config.noise));
  constants_.low_limit = Steps(Limit(config, std::pow(config.min_modulation_sigma, 2) / kSmall), kTurn);
  constants_.ratio_limit = Steps(Limit(config, kRatioSigmas * kRatioSigmas / kSmall), kTurn);
  const double least_noise = LeastNoise(set.estimator);
  constants_.noise_limit =
      Steps(Limit(config, std::pow(least_noise / config.max_phase_sigma_rad, 2) / kLarge), kTurn);
  std::size_t other = 0;
  for (std::size_t slot = 0; slot < 3; ++slot) {
    const double ratio = RatioToFirst(set.pattern, frequency_[slot]);
    constants_.mean_ratio[slot] = Steps(1 / (3 * ratio), kTurn);
    if (slot != constants_.first_slot) {
      constants_.compared_slot[other] = slot;
      constants_.ratio_least[other] = Steps(ratio * (1 - config.modulation_ratio_tolerance), 32768);
      constants_.ratio_most[other] = Steps(ratio * (1 + config.modulation_ratio_tolerance), 32768);
      ++other;
    }
  }
  constants_.quietness = {
      Steps(least_noise / set.estimator.PhaseNoise(static_cast<int>(frequency_[0])), kTurn),
      Steps(least_noise / set.estimator.PhaseNoise(static_cast<int>(frequency_[1])), kTurn)};
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

void PackedDecoder::SetVariance(const Set& set) {
  const int first = std::ranges::min(set.table.cells, {}, &FringeOrderTable::Entry::order).order;
  const double per_variance = PerVariance(set.config.noise),
               lit = set.config.noise.gain_dn * per_variance / kPerDn;
  const int count = 64 * OrderCount(set.table);
  std::vector<VarianceFactors> factors;
  double most_px2 = 0;
  for (int i = 0; i < count; ++i) {
    const VarianceFactors& one = factors.emplace_back(
        FindVarianceFactors(set.pattern, set.estimator, set.table.base, first + (i + 0.5) / 64));
    most_px2 = std::max({most_px2, one.all_px2, std::abs(lit * one.lit_px2)});
  }
  const double scale = 32767 / most_px2;
  const auto bits = [](double value) {
    return static_cast<std::uint32_t>(
        static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(value))));
  };
  for (const VarianceFactors& one : factors) {
    factors_.push_back(bits(scale * one.all_px2) | bits(scale * lit * one.lit_px2) << 16);
  }
  constants_.variance_scale_px2 = static_cast<float>(kVariance / (per_variance * scale));
}

bool PackedDecoder::Row(std::span<const cv::Mat> frames, int row, int saturation_dn,
                        DecodedView& view) const {
  PackedConstants constants = constants_;
  constants.cells = cells_.data();
  constants.factors = factors_.data();
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
    strip.variance_px2 = row % 2 == 0 ? view.variance_px2[row / 2] + column : nullptr;
    strip.cause = view.cause[row] + column;
    doubts = kernel_.Decode(constants, strip) || doubts;
  }
  return doubts;
}

}  // namespace forgescan
