// Random numbers that depend on nothing but their key, so that any part, view or pixel row can be simulated
// alone, in any order and on any number of threads, and still be the same. std::normal_distribution is not
// the same on every library.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>

namespace forgescan {

// What a stream is for: two purposes never share numbers, so that changing one imperfection leaves the others
// alone.
enum class RandomUse : std::uint64_t {
  kPartSize = 1,
  kPartPose,
  kPartHeat,
  kRobotVisit,
  kTeachingVisit,
  kCalibration,
  kMarkers,
  kPyrometer,
  kPixelNoise,
  kProjectorLevel,
  kTexture,
  kMeasuredPattern,
  kMeasuredNoise,
  kMeasuredExpansion,
};

// A bijective mix of 64 bits (the finaliser of splitmix64).
constexpr std::uint64_t MixBits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

class RandomStream {
 public:
  RandomStream(std::uint64_t seed, RandomUse use, std::initializer_list<int> key = {})
      : state_(MixBits(seed + 0x9E3779B97F4A7C15ull * static_cast<std::uint64_t>(use))) {
    for (const int k : key) {
      state_ = MixBits(state_ + 0x9E3779B97F4A7C15ull * (static_cast<std::uint64_t>(k) + 1));
    }
  }

  std::uint64_t Bits() { return MixBits(state_ += 0x9E3779B97F4A7C15ull); }
  // In [0, 1).
  double Uniform() { return static_cast<double>(Bits() >> 11) * 0x1p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // Mean 0, standard deviation 1 (Box-Muller, one of the pair).
  double Gaussian() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace forgescan
