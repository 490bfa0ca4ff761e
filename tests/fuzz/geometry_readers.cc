// Point clouds, meshes and poses.
#include <algorithm>
#include <cmath>

#include "services/common/geometry/cloud_io.h"
#include "services/common/input_file.h"
#include "tests/fuzz/readers.h"
#include "tools/forgescan/text_output.h"

namespace forgescan::fuzz {
namespace {

constexpr float kMaxCoordinateMm = 1e5F;

bool AllWithin(const std::vector<Eigen::Vector3f>& points) {
  return std::all_of(points.begin(), points.end(),
                     [](const auto& p) { return p.cwiseAbs().maxCoeff() <= kMaxCoordinateMm; });
}

std::string CloudProblem(const PointCloud& cloud) {
  const auto fits = [&cloud](std::size_t n) { return n == 0 || n == cloud.size(); };
  if (!fits(cloud.normals.size()) || !fits(cloud.sigma_mm.size()) || !fits(cloud.view.size())) {
    return "a cloud whose members have different lengths";
  }
  return AllWithin(cloud.points) ? "" : "a cloud with a point beyond 100 m";
}

std::string MeshProblem(const TriangleMesh& mesh) {
  for (const auto& corners : mesh.triangles) {
    for (const std::uint32_t corner : corners) {
      if (corner >= mesh.vertices.size()) return "a triangle with a corner that is not there";
    }
  }
  return AllWithin(mesh.vertices) ? "" : "a mesh with a vertex beyond 100 m";
}

PointCloud SmallCloud() {
  PointCloud cloud;
  for (int i = 0; i < 12; ++i) {
    const auto x = static_cast<float>(i);
    cloud.points.emplace_back(x, std::sin(x), 1000.F);
    cloud.normals.emplace_back(0.F, 0.F, -1.F);
    cloud.sigma_mm.push_back(0.01F);
    cloud.view.push_back(static_cast<std::uint16_t>(i / 4));
  }
  return cloud;
}

std::string WrittenPly() {
  const std::string path = ScratchFile("written.ply", "");
  return WritePly(path, SmallCloud()).ok() ? ReadInputFile(path).value() : std::string();
}

constexpr char kAsciiPly[] =
    "ply\nformat ascii 1.0\ncomment mm\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
    "double z\n"
    "property uchar red\nelement extra 2\nproperty list uchar int numbers\nend_header\n"
    "0 1.5 -2e1 255\nnan 0 0 0\n+3 4 5 6\n2 7 8\n0\n";
constexpr char kAsciiPcd[] =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F\n"
    "COUNT 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
    "1 2 3 0 0 1\nnan nan nan 0 0 0\n";
constexpr char kAsciiMesh[] =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n";

std::string BinaryPcd() {
  std::string bytes =
      "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 8 1\nTYPE F F F U\nCOUNT 1 1 1 3\nWIDTH 4\nHEIGHT 1\nPOINTS "
      "4\nDATA "
      "binary\n";
  return bytes + std::string(4 * 19, '\0');
}

std::string BinaryMesh(const char* encoding) {
  std::string bytes = std::string("ply\nformat ") + encoding +
                      " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                      "element face 1\nproperty list uchar uchar vertex_index\nend_header\n" +
                      std::string(36, '\0');
  return bytes + std::string("\3\0\1\2", 4);
}

Outcome ReadPoseFile(const std::string& bytes) {
  return Judge(ReadPose(ScratchFile("pose.txt", bytes)), "pose.txt", [](const Eigen::Isometry3d& pose) {
    const Eigen::Matrix3d rotation = pose.linear();
    const bool rigid = (rotation * rotation.transpose()).isIdentity(1e-9);
    return rigid && pose.matrix().allFinite() ? "" : "a pose that is not rigid";
  });
}

}  // namespace

std::vector<Reader> Readers() {
  const auto cloud = [](const std::string& bytes) {
    return Judge(ParsePointCloud(bytes, "cloud.ply"), "cloud.ply", CloudProblem);
  };
  const auto mesh = [](const std::string& bytes) {
    return Judge(ParseTriangleMesh(bytes, "mesh.ply"), "mesh.ply", MeshProblem);
  };
  return {
      {"ply_cloud", 20'000, {kAsciiPly, WrittenPly(), kAsciiMesh, BinaryMesh("binary_big_endian")}, cloud},
      {"pcd_cloud", 20'000, {kAsciiPcd, BinaryPcd()}, cloud},
      {"ply_mesh",
       20'000,
       {kAsciiMesh, BinaryMesh("binary_little_endian"), BinaryMesh("binary_big_endian")},
       mesh},
      {"pose",
       5000,
       {"1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n", "0,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1"},
       ReadPoseFile}};
}

}  // namespace forgescan::fuzz
