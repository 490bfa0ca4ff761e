#include "tools/forgescan/experiment/workpiece.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/common/model/model_import.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/replay/scratch_folder.h"
#include "tools/virtual_station/scene.h"

namespace forgescan {
namespace {

constexpr double kSpacingMm = 2;   // of the model's samples
constexpr double kAboutMm = 100;   // about the part's box: what the scanner's views see of the cell
constexpr double kLeastUp = -0.7;  // z of a normal that the scanner still sees from above

struct SurfacePoint {
  Eigen::Vector3d point, normal;
};

// Points evenly over triangles, by area.
class AreaSampler {
 public:
  template <typename Vertex, typename Triangle>
  AreaSampler(const std::vector<Vertex>& vertices, const std::vector<Triangle>& triangles) {
    double sum = 0;
    for (const Triangle& t : triangles) {
      const auto corner = [&](std::size_t i) -> Eigen::Vector3d {
        return vertices[static_cast<std::size_t>(t[i])].template cast<double>();
      };
      const Eigen::Vector3d a = corner(0), ab = corner(1) - a, ac = corner(2) - a, cross = ab.cross(ac);
      if (cross.norm() == 0 || cross.normalized().z() < kLeastUp) continue;
      sum += 0.5 * cross.norm();
      corners_.push_back({a, ab, ac, cross.normalized()});
      area_.push_back(sum);
    }
  }

  SurfacePoint Draw(RandomStream& random) const {
    const auto place = std::upper_bound(area_.begin(), area_.end(), area_.back() * random.Uniform());
    const auto index = std::min(static_cast<std::size_t>(place - area_.begin()), corners_.size() - 1);
    double u = random.Uniform(), v = random.Uniform();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Corners& c = corners_[index];
    return {c.a + u * c.ab + v * c.ac, c.normal};
  }

 private:
  struct Corners {
    Eigen::Vector3d a, ab, ac, normal;
  };
  std::vector<Corners> corners_;
  std::vector<double> area_;  // of this and all before
};

Result<Workpiece> Assemble(std::string name, ModelBundle bundle, SurfaceMesh clutter) {
  ASSIGN_OR_RETURN(RegistrationModel model, RegistrationModel::Build(bundle));
  return Workpiece{std::move(name), std::move(bundle), std::move(model), std::move(clutter), {}};
}

constexpr int kCoverColumns = 61, kCoverRows = 41;  // vertices, 4 mm apart
constexpr double kCoverStepMm = 4;

float CoverHeight(double x, double y) {
  const auto hump = [&](double cx, double cy, double wx, double wy) {
    return std::exp(-0.5 * (std::pow((x - cx) / wx, 2) + std::pow((y - cy) / wy, 2)));
  };
  return static_cast<float>(14 + 10 * hump(40, 20, 25, 25) + 7 * hump(-60, -15, 15, 40));
}

// Top as a height field, and a skirt down to the platform.
TriangleMesh CoverMesh() {
  TriangleMesh mesh;
  const auto x_of = [](int i) { return kCoverStepMm * (i - kCoverColumns / 2); };
  const auto y_of = [](int j) { return kCoverStepMm * (j - kCoverRows / 2); };
  for (int j = 0; j < kCoverRows; ++j) {
    for (int i = 0; i < kCoverColumns; ++i) {
      mesh.vertices.emplace_back(static_cast<float>(x_of(i)), static_cast<float>(y_of(j)),
                                 CoverHeight(x_of(i), y_of(j)));
    }
  }
  const auto quad = [&mesh](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  const auto at = [](int i, int j) { return static_cast<std::uint32_t>(j * kCoverColumns + i); };
  for (int j = 0; j + 1 < kCoverRows; ++j) {
    for (int i = 0; i + 1 < kCoverColumns; ++i) quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  }
  const auto skirt = [&](std::uint32_t a, std::uint32_t b) {  // outward to the right of a -> b
    const auto low = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const std::uint32_t corner : {a, b}) {
      const Eigen::Vector3f top = mesh.vertices[corner];
      mesh.vertices.emplace_back(top.x(), top.y(), 0.0F);
    }
    quad(low, low + 1, b, a);
  };
  for (int i = 0; i + 1 < kCoverColumns; ++i) {
    skirt(at(i, 0), at(i + 1, 0));
    skirt(at(i + 1, kCoverRows - 1), at(i, kCoverRows - 1));
  }
  for (int j = 0; j + 1 < kCoverRows; ++j) {
    skirt(at(0, j + 1), at(0, j));
    skirt(at(kCoverColumns - 1, j), at(kCoverColumns - 1, j + 1));
  }
  return mesh;
}

Eigen::Vector3d RandomDirection(RandomStream& random) {
  return Eigen::Vector3d(random.Gaussian(), random.Gaussian(), random.Gaussian()).normalized();
}

}  // namespace

Result<Workpiece> MakeAxleInClamp(const std::string& cell_file) {
  ASSIGN_OR_RETURN(const CellConfig config, LoadCellConfig(cell_file));
  ASSIGN_OR_RETURN(const ScratchFolder scratch, ScratchFolder::Make());
  const std::string step = (scratch.path() / "axle.step").string();
  RETURN_IF_ERROR(WriteAxleStep(config.part.nominal, step));
  ModelImportOptions import;
  import.spacing_mm = kSpacingMm;
  ASSIGN_OR_RETURN(ModelBundle bundle, LoadModel(step, import));
  return Assemble("axle in clamp", std::move(bundle), BuildCellMesh(config.boxes));
}

Result<Workpiece> MakeCoverOnPlatform() {
  ASSIGN_OR_RETURN(ModelBundle bundle, ModelFromMesh(CoverMesh(), kSpacingMm));
  const SurfaceMesh platform = BuildCellMesh({{{-300, -250, -10}, {300, 250, 0}}});
  ASSIGN_OR_RETURN(Workpiece cover, Assemble("cover on platform", std::move(bundle), platform));
  cover.hidden = {cover.model.box_low() - Eigen::Vector3d(0, 0, 100), cover.model.box_high()};
  return cover;
}

PointCloud SampleScan(const Workpiece& workpiece, const ScanRequest& request) {
  RandomStream random = DrawsOf(request.seed, Draw::kScan, {request.run});
  const AreaSampler part(workpiece.bundle.vertices, workpiece.bundle.triangles);
  const AreaSampler clutter(workpiece.clutter.vertices, workpiece.clutter.triangles);
  const Eigen::AlignedBox3d about(workpiece.model.box_low().array() - kAboutMm,
                                  workpiece.model.box_high().array() + kAboutMm);
  PointCloud cloud;
  while (cloud.size() < request.points) {
    const bool is_foreign = random.Uniform() < request.foreign_share;
    SurfacePoint p = (is_foreign ? clutter : part).Draw(random);
    while (is_foreign && (!about.contains(p.point) || workpiece.hidden.contains(p.point))) {
      p = clutter.Draw(random);
    }
    const Eigen::Vector3d point = p.point + request.noise_mm * random.Gaussian() * p.normal;
    cloud.points.push_back(point.cast<float>());
    cloud.normals.push_back(p.normal.cast<float>());
  }
  return cloud;
}

PointCloud MovedCloud(const PointCloud& cloud, const Eigen::Isometry3d& to_from_cloud) {
  PointCloud moved = cloud;
  for (Eigen::Vector3f& p : moved.points) p = (to_from_cloud * p.cast<double>()).cast<float>();
  for (Eigen::Vector3f& n : moved.normals) n = (to_from_cloud.linear() * n.cast<double>()).cast<float>();
  return moved;
}

Eigen::Isometry3d RandomOffset(const Eigen::Vector3d& center, double angle_rad, double shift_mm,
                               RandomStream& random) {
  const Eigen::Vector3d axis = RandomDirection(random), shift = shift_mm * RandomDirection(random);
  return Eigen::Translation3d(center + shift) * Eigen::AngleAxisd(angle_rad, axis) *
         Eigen::Translation3d(-center);
}

}  // namespace forgescan
