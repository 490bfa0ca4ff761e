#include "tests/services/reconstruction/phase_scene.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

void AddFrequency(double period_px, int frames, PatternSet& pattern) {
  FringeFrequency frequency{.period_px = period_px, .frame_index = {}, .shift_rad = {}};
  for (int i = 0; i < frames; ++i) {
    frequency.frame_index.push_back(pattern.frame_count());
    frequency.shift_rad.push_back(i * std::numbers::pi / 2);
    pattern.frame_names.push_back(fmt::format("{}", pattern.frame_count()));
  }
  pattern.frequencies.push_back(std::move(frequency));
}

struct Light {
  cv::Mat_<float> background_dn;
  cv::Mat_<float> modulation_dn;
};

// The ideal frame: period_px 0 is the reference.
cv::Mat_<float> Ideal(const Columns& columns, const Light& light, double period_px, double shift_or_level) {
  cv::Mat_<float> frame(columns.size());
  for (int y = 0; y < columns.rows; ++y) {
    for (int x = 0; x < columns.cols; ++x) {
      const bool is_lit = !std::isnan(columns(y, x));
      const double wave =
          period_px == 0 ? shift_or_level : std::cos(kTwoPi * columns(y, x) / period_px + shift_or_level);
      frame(y, x) =
          is_lit ? light.background_dn(y, x) + light.modulation_dn(y, x) * static_cast<float>(wave) : 10.0F;
    }
  }
  return frame;
}

cv::Mat Expose(const cv::Mat_<float>& ideal, double offset_dn, const CameraNoise& noise, cv::RNG& random,
               int type) {
  cv::Mat_<float> frame(ideal.size());
  random.fill(frame, cv::RNG::NORMAL, 0, 1);
  const auto read = static_cast<float>(noise.read_noise_dn * noise.read_noise_dn);
  const auto gain = static_cast<float>(noise.gain_dn), offset = static_cast<float>(offset_dn);
  for (int y = 0; y < ideal.rows; ++y) {
    for (int x = 0; x < ideal.cols; ++x) {
      const float grey = ideal(y, x) + offset;
      frame(y, x) = grey + frame(y, x) * std::sqrt(read + gain * std::max(grey, 0.0F));
    }
  }
  cv::Mat image;
  frame.convertTo(image, type, type == CV_8UC1 ? 1 : 257);
  return image;
}

std::vector<cv::Mat> RenderLight(const Columns& columns, const Light& light, const PatternSet& pattern,
                                 const PhaseLighting& lighting, int type) {
  cv::RNG random(lighting.seed);
  std::vector<cv::Mat> frames(static_cast<std::size_t>(pattern.frame_count()));
  const auto expose = [&](int index, double period_px, double shift_or_level) {
    frames[static_cast<std::size_t>(index)] = Expose(Ideal(columns, light, period_px, shift_or_level),
                                                     index * lighting.drift_dn, lighting.noise, random, type);
  };
  for (const FringeFrequency& frequency : pattern.frequencies) {
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      expose(frequency.frame_index[i], frequency.period_px, frequency.shift_rad[i]);
    }
  }
  if (pattern.reference_frame_index) {
    expose(*pattern.reference_frame_index, 0, pattern.ReferencePerModulation());
  }
  return frames;
}

}  // namespace

PatternSet StationPattern(Background background) {
  constexpr double kUnambiguousPx = 1984;
  PatternSet pattern;
  pattern.projector_width_px = 1920;
  pattern.background = background;
  const bool own = background == Background::kOwn;
  AddFrequency(kUnambiguousPx / 63, own ? 4 : 2, pattern);
  AddFrequency(kUnambiguousPx / 64, own ? 4 : 3, pattern);
  AddFrequency(kUnambiguousPx / 56, own ? 4 : 2, pattern);
  pattern.reference_contrast = 0.9;
  pattern.reference_frame_index = pattern.frame_count();
  pattern.frame_names.push_back("white");
  return pattern;
}

std::vector<cv::Mat> RenderColumns(const Columns& columns, const PatternSet& pattern,
                                   const PhaseLighting& lighting, int type) {
  Light light;
  light.background_dn = cv::Mat_<float>(columns.size(), static_cast<float>(lighting.background_dn));
  light.modulation_dn = cv::Mat_<float>(columns.size(), static_cast<float>(lighting.modulation_dn));
  return RenderLight(columns, light, pattern, lighting, type);
}

StationScene RenderStation(cv::Size size, const PatternSet& pattern, const CameraNoise& noise) {
  StationScene scene{.columns = Columns(size),
                     .modulation_dn = cv::Mat_<float>(size),
                     .background_dn = cv::Mat_<float>(size),
                     .frames = {}};
  const double width = size.width, height = size.height;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double across = x / width, down = y / height;
      const bool on_rim = across < 0.06 || across > 0.95 || down < 0.04 || down > 0.97;
      const bool on_disc = std::hypot((across - 0.7) * width / height, down - 0.6) < 0.12;
      const double step_px = across > 0.3 && across < 0.4 && down > 0.2 && down < 0.5 ? 25 : 0;
      const double column = 100 + 0.72 * 2448 * across + 40 * std::sin(4 * down) + step_px;
      scene.columns(y, x) = on_rim || on_disc ? std::numeric_limits<double>::quiet_NaN() : column;
      scene.modulation_dn(y, x) = static_cast<float>(70 + 15 * std::sin(11 * across) * std::cos(9 * down));
      scene.background_dn(y, x) = scene.modulation_dn(y, x) / 0.9F + 8;
    }
  }
  scene.frames = RenderLight(scene.columns, {scene.background_dn, scene.modulation_dn}, pattern,
                             {.noise = noise}, CV_8UC1);
  return scene;
}

}  // namespace forgescan
