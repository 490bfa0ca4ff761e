// Rays against triangles: the only user of Embree.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "services/common/result.h"
#include "tools/virtual_station/surface_mesh.h"

namespace forgescan {

inline constexpr int kRayPacket = 8;

// Up to eight rays that start at one point. Bit i of `active` says that ray i counts.
struct RayPacket {
  Eigen::Vector3f origin;
  std::array<Eigen::Vector3f, kRayPacket> direction;
  unsigned active = 0;
};

class RayScene {
 public:
  static constexpr int kNothing = -1;

  // The surfaces must be in one frame; triangle indices count through all of them in the order given.
  static Result<RayScene> Build(std::span<const SurfaceMesh* const> surfaces);
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;
  ~RayScene();

  // Index of the first triangle each ray meets, or kNothing. Any thread.
  std::array<int, kRayPacket> FirstHit(const RayPacket& rays) const;

  // Bit i: something lies on ray i between 0.0005 and 0.9995 of its direction's length. Any thread.
  unsigned Blocked(const RayPacket& rays) const;

 private:
  struct State;
  explicit RayScene(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace forgescan
