#include "tools/virtual_station/exposure.h"

#include <algorithm>
#include <cmath>

#include "tools/virtual_station/parallel.h"

namespace forgescan {
namespace {

constexpr int kLevelSteps = 256;       // per fringe; linear between: error < 1e-4 of the amplitude
constexpr int kNoiseLength = 1 << 16;  // values, reused with a random start in every row
constexpr int kLongestRow = 4096;

// Pattern level over one period, and whether it depends on u at all.
class LevelTable {
 public:
  LevelTable(const ProjectorLightConfig& light, const Pattern& pattern, double factor) {
    const double period = pattern.period_px == 0.0 ? 1.0 : pattern.period_px;
    steps_per_px_ = static_cast<float>(kLevelSteps / period);
    for (int i = 0; i < kLevelSteps + 2; ++i) {
      level_[static_cast<std::size_t>(i)] =
          static_cast<float>(factor * PatternLevel(light, pattern, i * period / kLevelSteps));
    }
  }

  float At(float u_px) const {
    // + one whole table: u starts at -0.5, and conversion to int cuts towards zero.
    const float step = u_px * steps_per_px_ + static_cast<float>(kLevelSteps);
    const int whole = static_cast<int>(step);
    const float* level = &level_[static_cast<std::size_t>(whole % kLevelSteps)];
    return level[0] + (step - static_cast<float>(whole)) * (level[1] - level[0]);
  }

 private:
  float steps_per_px_;
  std::array<float, kLevelSteps + 2> level_;
};

const std::vector<float>& NoiseTable() {
  static const std::vector<float> table = [] {
    std::vector<float> values(kNoiseLength + kLongestRow);
    RandomStream random(1, RandomUse::kPixelNoise);
    for (float& value : values) {
      value = static_cast<float>(random.Gaussian());
    }
    return values;
  }();
  return table;
}

float Grey(const SurfaceSample& sample, const LevelTable& level) {
  return sample.lit > 0.0f ? sample.base + sample.lit * level.At(sample.u_px) : sample.base;
}

void FillRow(const SurfaceSample* sample, int width, const LevelTable& level, float* grey) {
  for (int x = 0; x < width; ++x) {
    grey[x] = Grey(sample[x], level);
  }
}

float EdgeGrey(const EdgePixel& edge, const LevelTable& level) {
  float sum = 0.0f;
  for (const SurfaceSample& sample : edge.sample) {
    sum += 0.25f * Grey(sample, level);
  }
  return sum;
}

void Digitise(const float* grey, const float* noise, int width, const SensorConfig& sensor,
              std::uint8_t* out) {
  const auto read2 = static_cast<float>(sensor.read_noise_dn * sensor.read_noise_dn);
  const auto gain = static_cast<float>(sensor.gain_dn);
  for (int x = 0; x < width; ++x) {
    const float value = grey[x] + noise[x] * std::sqrt(read2 + gain * grey[x]) + 0.5f;
    out[x] = static_cast<std::uint8_t>(std::min(std::max(value, 0.0f), 255.0f));
  }
}

}  // namespace

std::vector<std::uint8_t> ExposeImage(const GeometryMap& map, const ExposureRequest& request) {
  const ImageKey& key = request.key;
  RandomStream flicker(key.seed, RandomUse::kProjectorLevel, {key.part, key.view, key.visit, key.pattern});
  const LevelTable level(request.light, request.pattern, 1.0 + request.light.level_sd * flicker.Gaussian());
  const std::vector<float>& noise = NoiseTable();
  std::vector<std::uint8_t> image(map.sample.size());
  const auto row_start = [&](int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width);
  };
  ForEachIndex(map.height, request.threads, [&](int y) {
    std::array<float, kLongestRow> grey;
    FillRow(&map.sample[row_start(y)], map.width, level, grey.data());
    const auto below = [](const EdgePixel& edge, std::size_t pixel) {
      return static_cast<std::size_t>(edge.pixel) < pixel;
    };
    auto edge = std::lower_bound(map.edges.begin(), map.edges.end(), row_start(y), below);
    for (; edge != map.edges.end() && below(*edge, row_start(y + 1)); ++edge) {
      grey[static_cast<std::size_t>(edge->pixel) - row_start(y)] = EdgeGrey(*edge, level);
    }
    RandomStream random(key.seed, RandomUse::kPixelNoise,
                        {key.part, key.view, key.visit, static_cast<int>(key.side), key.pattern, y});
    const float* row_noise = &noise[random.Bits() % kNoiseLength];
    Digitise(grey.data(), row_noise, map.width, request.sensor, &image[row_start(y)]);
  });
  return image;
}

}  // namespace forgescan
