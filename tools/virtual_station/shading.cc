#include "tools/virtual_station/shading.h"

#include <algorithm>
#include <cmath>

namespace forgescan {
namespace {

constexpr double kGlowReferenceDegc = 900.0;
constexpr int kGlossExponent = 32;

// In [-1, 1], fixed for a lattice node.
double NodeValue(std::uint64_t seed, std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto word = static_cast<std::uint64_t>(x * 73856093 ^ y * 19349663 ^ z * 83492791);
  return static_cast<double>(MixBits(seed + word) >> 11) * 0x1p-52 - 1.0;
}

double Blend(double a, double b, double t) { return a + (b - a) * t; }

// Smooth noise in [-1, 1]: node values of a unit lattice, blended.
double ValueNoise(std::uint64_t seed, const Eigen::Vector3d& p) {
  const Eigen::Vector3d cell = p.array().floor();
  const Eigen::Vector3d f = p - cell;
  const Eigen::Vector3d t = f.array() * f.array() * (3.0 - 2.0 * f.array());
  const auto x = static_cast<std::int64_t>(cell.x());
  const auto y = static_cast<std::int64_t>(cell.y());
  const auto z = static_cast<std::int64_t>(cell.z());
  const auto row = [&](std::int64_t j, std::int64_t k) {
    return Blend(NodeValue(seed, x, j, k), NodeValue(seed, x + 1, j, k), t.x());
  };
  return Blend(Blend(row(y, z), row(y + 1, z), t.y()), Blend(row(y, z + 1), row(y + 1, z + 1), t.y()), t.z());
}

}  // namespace

Shader::Shader(const ShadingSettings& settings) : settings_(settings) {
  glow_dn_ = settings_.sensor.glow_dn *
             std::exp(settings_.sensor.glow_per_k * (settings_.part_temperature_degc - kGlowReferenceDegc));
}

double Shader::Albedo(Surface surface, const Eigen::Vector3d& p_in_array) const {
  if (surface == Surface::kCell) {
    return settings_.surface.cell_albedo;
  }
  const Eigen::Vector3d p = settings_.part_from_array * p_in_array / settings_.surface.texture_size_mm;
  const double noise =
      0.65 * ValueNoise(settings_.texture_seed, p) + 0.35 * ValueNoise(settings_.texture_seed + 1, 5.0 * p);
  return settings_.surface.part_albedo * (1.0 + settings_.surface.texture_contrast * noise);
}

double Shader::Lit(Surface surface, const LightPath& path) const {
  const double cosine = path.normal.dot(path.to_projector);
  if (cosine <= 0.0) {
    return 0.0;
  }
  const double near = settings_.working_distance_mm / path.projector_distance_mm;
  const Eigen::Vector3d half = (path.to_camera + path.to_projector).normalized();
  const double gloss = std::pow(std::max(0.0, path.normal.dot(half)), kGlossExponent);
  const double reflected = Albedo(surface, path.point) * cosine + settings_.surface.specular * gloss;
  return settings_.sensor.white_dn * settings_.exposure * near * near * reflected;
}

double Shader::Base(Surface surface, const Eigen::Vector3d& p_in_array) const {
  const double dark = settings_.sensor.dark_level_dn;
  if (surface == Surface::kNone) {
    return dark;
  }
  const double ambient = settings_.sensor.ambient_dn * Albedo(surface, p_in_array);
  return dark + settings_.exposure * (ambient + (surface == Surface::kPart ? glow_dn_ : 0.0));
}

}  // namespace forgescan
