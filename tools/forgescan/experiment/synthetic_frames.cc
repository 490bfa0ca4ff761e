#include "tools/forgescan/experiment/synthetic_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/forgescan/experiment/draws.h"

namespace forgescan {
namespace {

constexpr double kUnambiguousPx = 1984;
constexpr std::array kFringes = {64.0, 63.0, 56.0};
constexpr double kCounts = 257;  // a grey value, in 16-bit counts
constexpr double kMean = 0.5, kAmplitude = 0.45;

}  // namespace

PatternSet SyntheticPattern(Background background) {
  PatternSet pattern;
  pattern.projector_width_px = 1920;
  pattern.background = background;
  int frame = 0;
  for (const double fringes : kFringes) {
    FringeFrequency frequency;
    frequency.period_px = kUnambiguousPx / fringes;
    const int steps = background == Background::kOwn ? 4 : frame == 0 ? 3 : 2;
    for (int i = 0; i < steps; ++i) {
      frequency.frame_index.push_back(frame);
      frequency.shift_rad.push_back(0.5 * std::numbers::pi * i);
      pattern.frame_names.push_back(fmt::format("ramp_{:02}", frame++));
    }
    pattern.frequencies.push_back(frequency);
  }
  return pattern;
}

double RampColumnPx(const RampScene& scene, int x, int y) {
  constexpr double kFirstPx = 100, kLastPx = 1800;
  const double row = (y + 0.5) / scene.height_px;
  return kFirstPx + (kLastPx - kFirstPx) * (x + row) / scene.width_px;
}

double PhaseAt(const FringeFrequency& frequency, double column_px) {
  return 2 * std::numbers::pi * column_px / frequency.period_px;
}

double Wrapped(double rad) { return std::remainder(rad, 2 * std::numbers::pi); }

std::vector<cv::Mat> RampFrames(const PatternSet& pattern, const RampScene& scene) {
  std::vector<cv::Mat> frames(static_cast<std::size_t>(pattern.frame_count()));
  for (const FringeFrequency& frequency : pattern.frequencies) {
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      const int index = frequency.frame_index[i];
      RandomStream random = DrawsOf(scene.seed, Draw::kGreyNoise, {index});
      cv::Mat_<std::uint16_t> frame(scene.height_px, scene.width_px);
      for (int y = 0; y < frame.rows; ++y) {
        for (int x = 0; x < frame.cols; ++x) {
          const double phase = PhaseAt(frequency, RampColumnPx(scene, x, y)) + frequency.shift_rad[i];
          const double level = kMean + kAmplitude * std::cos(phase);
          const double light = scene.emitted ? scene.emitted(level) : level;
          const double grey = scene.dark_dn + scene.scale_dn * light + scene.noise_dn * random.Gaussian();
          frame(y, x) = static_cast<std::uint16_t>(std::clamp(kCounts * grey + 0.5, 0.0, 65535.0));
        }
      }
      frames[static_cast<std::size_t>(index)] = frame;
    }
  }
  return frames;
}

}  // namespace forgescan
