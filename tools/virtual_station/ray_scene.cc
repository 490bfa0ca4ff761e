#include "tools/virtual_station/ray_scene.h"

#include <embree3/rtcore.h>

#include <limits>
#include <vector>

namespace forgescan {

struct RayScene::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<int> first_triangle;  // of each geometry

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    if (scene != nullptr) {
      rtcReleaseScene(scene);
    }
    if (device != nullptr) {
      rtcReleaseDevice(device);
    }
  }
};

namespace {

// False if Embree is out of memory.
bool Attach(RTCDevice device, RTCScene scene, const SurfaceMesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  if (vertex == nullptr || index == nullptr) {
    rtcReleaseGeometry(geometry);
    return false;
  }
  for (const Eigen::Vector3d& v : mesh.vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      *vertex++ = static_cast<float>(v(axis));
    }
  }
  for (const auto& triangle : mesh.triangles) {
    for (const int i : triangle) {
      *index++ = static_cast<unsigned>(i);
    }
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  return true;
}

void FillRays(const RayPacket& rays, float near, float far, RTCRay8& ray) {
  for (int i = 0; i < kRayPacket; ++i) {
    const Eigen::Vector3f& direction = rays.direction[static_cast<std::size_t>(i)];
    ray.org_x[i] = rays.origin.x();
    ray.org_y[i] = rays.origin.y();
    ray.org_z[i] = rays.origin.z();
    ray.dir_x[i] = direction.x();
    ray.dir_y[i] = direction.y();
    ray.dir_z[i] = direction.z();
    ray.tnear[i] = near;
    ray.tfar[i] = far;
    ray.time[i] = 0.0f;
    ray.mask[i] = ~0u;
    ray.id[i] = 0;
    ray.flags[i] = 0;
  }
}

void FillValid(unsigned active, int* valid) {
  for (int i = 0; i < kRayPacket; ++i) {
    valid[i] = (active >> i & 1u) != 0 ? -1 : 0;
  }
}

RTCIntersectContext CoherentContext() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

}  // namespace

RayScene::RayScene(std::unique_ptr<State> state) : state_(std::move(state)) {}
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;
RayScene::~RayScene() = default;

Result<RayScene> RayScene::Build(std::span<const SurfaceMesh* const> surfaces) {
  auto state = std::make_unique<State>();
  // One thread: the build is short, and the machine is shared with the services under test.
  state->device = rtcNewDevice("threads=1,user_threads=0");
  if (state->device == nullptr) {
    return Fail(ErrorCode::kUnavailable, "Embree has no device (error {})",
                static_cast<int>(rtcGetDeviceError(nullptr)));
  }
  state->scene = rtcNewScene(state->device);
  rtcSetSceneFlags(state->scene, RTC_SCENE_FLAG_ROBUST);
  int first = 0;
  for (const SurfaceMesh* surface : surfaces) {
    if (!Attach(state->device, state->scene, *surface)) {
      return Fail(ErrorCode::kUnavailable, "Embree has no memory for {} triangles",
                  surface->triangles.size());
    }
    state->first_triangle.push_back(first);
    first += static_cast<int>(surface->triangles.size());
  }
  rtcCommitScene(state->scene);
  return RayScene(std::move(state));
}

std::array<int, kRayPacket> RayScene::FirstHit(const RayPacket& rays) const {
  alignas(32) RTCRayHit8 packet;
  alignas(32) int valid[kRayPacket];
  FillRays(rays, 0.0f, std::numeric_limits<float>::infinity(), packet.ray);
  FillValid(rays.active, valid);
  for (int i = 0; i < kRayPacket; ++i) {
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context = CoherentContext();
  rtcIntersect8(valid, state_->scene, &context, &packet);
  std::array<int, kRayPacket> triangle;
  for (std::size_t i = 0; i < kRayPacket; ++i) {
    const unsigned geometry = packet.hit.geomID[i];
    const bool hit = valid[i] != 0 && geometry != RTC_INVALID_GEOMETRY_ID;
    triangle[i] = hit ? state_->first_triangle[geometry] + static_cast<int>(packet.hit.primID[i]) : kNothing;
  }
  return triangle;
}

unsigned RayScene::Blocked(const RayPacket& rays) const {
  alignas(32) RTCRay8 packet;
  alignas(32) int valid[kRayPacket];
  FillRays(rays, 0.0005f, 0.9995f, packet);
  FillValid(rays.active, valid);
  RTCIntersectContext context = CoherentContext();
  rtcOccluded8(valid, state_->scene, &context, &packet);
  unsigned blocked = 0;
  for (unsigned i = 0; i < kRayPacket; ++i) {
    blocked |= (valid[i] != 0 && packet.tfar[i] < 0.0f ? 1u : 0u) << i;  // Embree writes -infinity
  }
  return blocked;
}

}  // namespace forgescan
