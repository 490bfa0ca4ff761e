#include "tools/virtual_station/geometry_map.h"

#include <algorithm>
#include <cmath>

#include "tools/virtual_station/parallel.h"

namespace forgescan {
namespace {

constexpr int kTile = 16;              // px, side of the squares that are skipped if they see nothing
constexpr double kOutlineSlope = 8.0;  // depth step between neighbours, in pixel widths: 83 deg of tilt
constexpr double kNearestMm = 50.0;    // nothing of the scene comes closer to a camera
constexpr double kWidestSlope = 1.5;   // beyond, the lens model folds back; far outside every image

// A traced point and what the camera gets from it.
struct Traced {
  SurfaceSample sample;
  Surface surface = Surface::kNone;
  float depth_mm = 0.0f;
};

class Mapper {
 public:
  Mapper(const PosedScene& scene, const MapRequest& request)
      : scene_(scene),
        request_(request),
        shader_(request.shading),
        camera_(CameraOf(request.rig, request.side)),
        array_from_camera_(request.array_from_rig * camera_.camera_from_rig.inverse()),
        projector_from_array_(request.rig.projector.camera_from_rig * request.array_from_rig.inverse()),
        camera_centre_(array_from_camera_.translation()),
        projector_centre_(projector_from_array_.inverse().translation()) {}

  GeometryMap Run() {
    map_.width = request_.rays.width;
    map_.height = request_.rays.height;
    const std::size_t n = request_.rays.ray.size();
    SurfaceSample empty;
    empty.base = static_cast<float>(shader_.Base(Surface::kNone, Eigen::Vector3d::Zero()));
    map_.sample.assign(n, empty);
    map_.surface.assign(n, Surface::kNone);
    depth_mm_.assign(n, 0.0f);
    MarkTiles();
    ForEachIndex(tile_rows_, request_.threads, [&](int row) { TraceTileRow(row); });
    edges_of_row_.resize(static_cast<std::size_t>(map_.height));
    ForEachIndex(map_.height, request_.threads, [&](int y) { RefineRow(y); });
    for (const auto& row : edges_of_row_) {
      map_.edges.insert(map_.edges.end(), row.begin(), row.end());
    }
    return std::move(map_);
  }

 private:
  std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(map_.width) + static_cast<std::size_t>(x);
  }

  void MarkTiles() {
    tile_columns_ = (map_.width + kTile - 1) / kTile;
    tile_rows_ = (map_.height + kTile - 1) / kTile;
    seen_.assign(static_cast<std::size_t>(tile_columns_) * static_cast<std::size_t>(tile_rows_), 0);
    MarkMesh(scene_.part_in_array());
    MarkMesh(scene_.cell_in_array());
  }

  void MarkMesh(const SurfaceMesh& mesh) {
    const Eigen::Isometry3d camera_from_array = array_from_camera_.inverse();
    std::vector<Eigen::Vector3d> p_in_camera;  // x and y replaced by the pixel
    for (const Eigen::Vector3d& v : mesh.vertices) {
      Eigen::Vector3d p = camera_from_array * v;
      const double z = std::max(p.z(), kNearestMm);
      const Eigen::Vector2d slope = (p.head<2>() / z).cwiseMax(-kWidestSlope).cwiseMin(kWidestSlope);
      p.head<2>() = Project(camera_.lens, slope.homogeneous());
      p_in_camera.push_back(p);
    }
    for (const auto& t : mesh.triangles) {
      const auto corner = [&](std::size_t i) { return p_in_camera[static_cast<std::size_t>(t[i])]; };
      const Eigen::Vector3d low = corner(0).cwiseMin(corner(1)).cwiseMin(corner(2));
      const Eigen::Vector3d high = corner(0).cwiseMax(corner(1)).cwiseMax(corner(2));
      if (high.z() > kNearestMm) {
        MarkBox(low.head<2>().array() - 1.0, high.head<2>().array() + 1.0);
      }
    }
  }

  void MarkBox(const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
    const auto tile = [](double pixel, int count) {
      return static_cast<int>(std::clamp(std::floor(pixel / kTile), -1.0, static_cast<double>(count)));
    };
    const int last_x = std::min(tile(high.x(), tile_columns_), tile_columns_ - 1);
    const int last_y = std::min(tile(high.y(), tile_rows_), tile_rows_ - 1);
    for (int y = std::max(tile(low.y(), tile_rows_), 0); y <= last_y; ++y) {
      for (int x = std::max(tile(low.x(), tile_columns_), 0); x <= last_x; ++x) {
        seen_[static_cast<std::size_t>(y * tile_columns_ + x)] = 1;
      }
    }
  }

  void TraceTileRow(int tile_y) {
    for (int tile_x = 0; tile_x < tile_columns_; ++tile_x) {
      if (seen_[static_cast<std::size_t>(tile_y * tile_columns_ + tile_x)] == 0) {
        continue;
      }
      for (int y = tile_y * kTile; y < std::min(map_.height, (tile_y + 1) * kTile); ++y) {
        for (int x = tile_x * kTile; x < std::min(map_.width, (tile_x + 1) * kTile); x += kRayPacket) {
          TracePixels(x, y, std::min(kRayPacket, map_.width - x));
        }
      }
    }
  }

  void TracePixels(int x, int y, int count) {
    std::array<Eigen::Vector2f, kRayPacket> slope;
    slope.fill(request_.rays.ray[At(x, y)]);
    std::copy_n(&request_.rays.ray[At(x, y)], count, slope.begin());
    const auto traced = Trace(slope, (1u << count) - 1u);
    for (int i = 0; i < count; ++i) {
      const Traced& t = traced[static_cast<std::size_t>(i)];
      map_.sample[At(x + i, y)] = t.sample;
      map_.surface[At(x + i, y)] = t.surface;
      depth_mm_[At(x + i, y)] = t.depth_mm;
    }
  }

  std::array<Traced, kRayPacket> Trace(const std::array<Eigen::Vector2f, kRayPacket>& slope,
                                       unsigned active) const {
    RayPacket view;
    view.origin = camera_centre_.cast<float>();
    view.active = active;
    std::array<Eigen::Vector3d, kRayPacket> direction;
    for (std::size_t i = 0; i < kRayPacket; ++i) {
      direction[i] = array_from_camera_.linear() * slope[i].cast<double>().homogeneous();
      view.direction[i] = direction[i].cast<float>();
    }
    const std::array<int, kRayPacket> triangle = scene_.rays().FirstHit(view);
    RayPacket light;
    light.origin = projector_centre_.cast<float>();
    light.direction.fill(Eigen::Vector3f::UnitZ());
    std::array<Traced, kRayPacket> traced;
    for (std::size_t i = 0; i < kRayPacket; ++i) {
      const Eigen::Vector3d p = triangle[i] < 0 ? Eigen::Vector3d::Zero().eval()
                                                : scene_.Meet(triangle[i], camera_centre_, direction[i]);
      traced[i] = Shade(triangle[i], p);
      if (traced[i].sample.lit > 0.0f) {
        light.direction[i] = (p - projector_centre_).cast<float>();
        light.active |= 1u << i;
      }
    }
    const unsigned blocked = light.active == 0 ? 0 : scene_.rays().Blocked(light);
    for (std::size_t i = 0; i < kRayPacket; ++i) {
      traced[i].sample.lit = (blocked >> i & 1u) != 0 ? 0.0f : traced[i].sample.lit;
    }
    return traced;
  }

  // Without shadows.
  Traced Shade(int triangle, const Eigen::Vector3d& p_in_array) const {
    Traced traced;
    traced.surface = scene_.SurfaceOf(triangle);
    traced.sample.base = static_cast<float>(shader_.Base(traced.surface, p_in_array));
    if (traced.surface == Surface::kNone) {
      return traced;
    }
    const Eigen::Vector3d to_camera = camera_centre_ - p_in_array;
    traced.depth_mm = static_cast<float>(to_camera.norm());
    const Eigen::Vector3d p_in_projector = projector_from_array_ * p_in_array;
    const Eigen::Vector2d pixel = Project(request_.rig.projector.lens, p_in_projector);
    const PinholeCamera& projector = request_.rig.projector;
    const bool in_field = p_in_projector.z() > 0.0 && pixel.x() >= -0.5 &&
                          pixel.x() < projector.width_px - 0.5 && pixel.y() >= -0.5 &&
                          pixel.y() < projector.height_px - 0.5;
    if (in_field) {
      const Eigen::Vector3d to_projector = projector_centre_ - p_in_array;
      const LightPath path{p_in_array, scene_.Normal(triangle), to_camera.normalized(),
                           to_projector.normalized(), to_projector.norm()};
      traced.sample.lit = static_cast<float>(shader_.Lit(traced.surface, path));
      traced.sample.u_px = static_cast<float>(pixel.x());
    }
    return traced;
  }

  bool Differ(std::size_t a, std::size_t b) const {
    const bool lit_a = map_.sample[a].lit > 0.0f;
    const bool lit_b = map_.sample[b].lit > 0.0f;
    return map_.surface[a] != map_.surface[b] || lit_a != lit_b ||
           std::abs(depth_mm_[a] - depth_mm_[b]) * camera_.lens.fx_px > kOutlineSlope * depth_mm_[a];
  }

  // Outline pixels get four samples a quarter pixel from their centre.
  void RefineRow(int y) {
    const int above = std::max(y - 1, 0);
    const int below = std::min(y + 1, map_.height - 1);
    for (int x = 0; x < map_.width; ++x) {
      const std::size_t here = At(x, y);
      const int right = std::min(x + 1, map_.width - 1);
      const int left = std::max(x - 1, 0);
      if (!Differ(here, At(x, below)) && !Differ(here, At(right, y)) && !Differ(here, At(x, above)) &&
          !Differ(here, At(left, y))) {
        continue;
      }
      const Eigen::Vector2f across =
          (request_.rays.ray[At(right, y)] - request_.rays.ray[At(left, y)]) / float(right - left);
      const Eigen::Vector2f down =
          (request_.rays.ray[At(x, below)] - request_.rays.ray[At(x, above)]) / float(below - above);
      std::array<Eigen::Vector2f, kRayPacket> slope;
      for (std::size_t i = 0; i < kRayPacket; ++i) {
        slope[i] = request_.rays.ray[here] + across * (i % 2 == 0 ? -0.25f : 0.25f) +
                   down * (i % 4 < 2 ? -0.25f : 0.25f);
      }
      const auto traced = Trace(slope, 0xFu);
      EdgePixel edge{static_cast<int>(here), {}};
      for (std::size_t i = 0; i < 4; ++i) {
        edge.sample[i] = traced[i].sample;
      }
      edges_of_row_[static_cast<std::size_t>(y)].push_back(edge);
    }
  }

  const PosedScene& scene_;
  const MapRequest& request_;
  const Shader shader_;
  const PinholeCamera& camera_;
  const Eigen::Isometry3d array_from_camera_, projector_from_array_;
  const Eigen::Vector3d camera_centre_, projector_centre_;
  GeometryMap map_;
  std::vector<float> depth_mm_;
  int tile_columns_ = 0, tile_rows_ = 0;
  std::vector<char> seen_;
  std::vector<std::vector<EdgePixel>> edges_of_row_;
};

}  // namespace

GeometryMap BuildGeometryMap(const PosedScene& scene, const MapRequest& request) {
  return Mapper(scene, request).Run();
}

}  // namespace forgescan
