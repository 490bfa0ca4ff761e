#include "tools/virtual_station/scene.h"

#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

constexpr double kLargestSquareMm = 25.0;

// The rectangle origin + [0,1] u + [0,1] v, outward normal along u x v.
SurfaceMesh Rectangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  const int nu = static_cast<int>(std::ceil(u.norm() / kLargestSquareMm));
  const int nv = static_cast<int>(std::ceil(v.norm() / kLargestSquareMm));
  SurfaceMesh mesh;
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      mesh.vertices.push_back(origin + u * (static_cast<double>(i) / nu) + v * (static_cast<double>(j) / nv));
    }
  }
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      const int a = j * (nu + 1) + i;
      const int b = a + nu + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return mesh;
}

SurfaceMesh BoxMesh(const BoxConfig& box) {
  const Eigen::Vector3d size = box.high_mm - box.low_mm;
  SurfaceMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d u = size((axis + 1) % 3) * Eigen::Vector3d::Unit((axis + 1) % 3);
    const Eigen::Vector3d v = size((axis + 2) % 3) * Eigen::Vector3d::Unit((axis + 2) % 3);
    Append(Rectangle(box.low_mm, v, u), mesh);
    Append(Rectangle(box.low_mm + size(axis) * Eigen::Vector3d::Unit(axis), u, v), mesh);
  }
  return mesh;
}

}  // namespace

SurfaceMesh BuildCellMesh(const std::vector<BoxConfig>& boxes) {
  SurfaceMesh mesh_in_array;
  for (const BoxConfig& box : boxes) Append(BoxMesh(box), mesh_in_array);
  return mesh_in_array;
}

SurfaceMesh BuildPostMesh(const std::vector<PostConfig>& posts) {
  SurfaceMesh mesh_in_array;
  for (const PostConfig& post : posts) {
    const double half_mm = 0.5 * post.width_mm;
    SurfaceMesh mesh_in_post =
        BoxMesh({{-half_mm, -half_mm, post.foot_z_mm - post.top_mm.z()}, {half_mm, half_mm, 0}});
    const Eigen::AngleAxisd turn(post.turn_deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ());
    for (Eigen::Vector3d& v : mesh_in_post.vertices) v = post.top_mm + turn * v;
    Append(mesh_in_post, mesh_in_array);
  }
  return mesh_in_array;
}

Eigen::Isometry3d TaughtRigPose(const ViewConfig& view, double working_distance_mm) {
  const Eigen::Vector3d z = -view.towards_rig.normalized();
  const Eigen::Vector3d x = (view.baseline - view.baseline.dot(z) * z).normalized();
  Eigen::Isometry3d array_from_rig = Eigen::Isometry3d::Identity();
  array_from_rig.linear() << x, z.cross(x), z;
  array_from_rig.translation() = view.target_mm - working_distance_mm * z;
  return array_from_rig;
}

Eigen::Isometry3d SmallMotion(RandomStream& random, double position_sd_mm, double rotation_sd_rad) {
  Eigen::Vector3d shift;
  Eigen::Vector3d turn;
  for (int i = 0; i < 3; ++i) {
    shift(i) = position_sd_mm * random.Gaussian();
    turn(i) = rotation_sd_rad * random.Gaussian();
  }
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (turn.norm() > 0.0) {
    motion.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  }
  motion.translation() = shift;
  return motion;
}

AxleSize ActualSize(const PartConfig& config, std::uint64_t seed, int part) {
  RandomStream random(seed, RandomUse::kPartSize, {part});
  AxleSize size = config.nominal;
  size.total_length_mm += config.length_sd_mm * random.Gaussian();
  const double plate_wear = config.plate_wear_mm_per_part * part;
  size.left_plate_width_mm += plate_wear + config.plate_sd_mm * random.Gaussian();
  size.right_plate_width_mm += plate_wear + config.plate_sd_mm * random.Gaussian();
  const double cylinder_wear = config.cylinder_wear_mm_per_part * part;
  size.left_cylinder_diameter_mm += cylinder_wear + config.cylinder_sd_mm * random.Gaussian();
  size.right_cylinder_diameter_mm += cylinder_wear + config.cylinder_sd_mm * random.Gaussian();
  for (const OddPart& odd : config.odd_parts) {
    if (odd.part == part) {
      size.*odd.size_mm = odd.mm;
    }
  }
  return size;
}

Eigen::Isometry3d ArrayFromPart(const PartConfig& config, std::uint64_t seed, int part) {
  RandomStream random(seed, RandomUse::kPartPose, {part});
  Eigen::Isometry3d array_from_part = Eigen::Isometry3d::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    const double most = config.rotation_scatter_deg * std::numbers::pi / 180.0;
    array_from_part.rotate(Eigen::AngleAxisd(random.Uniform(-most, most), Eigen::Vector3d::Unit(axis)));
  }
  for (int axis = 0; axis < 3; ++axis) {
    array_from_part.translation()(axis) =
        random.Uniform(-config.position_scatter_mm, config.position_scatter_mm);
  }
  return array_from_part;
}

}  // namespace forgescan
