// A plain axle for tests: box beam, two plates, two end cylinders, with the face names of a real axle; and a
// synthetic scan of it with foreign points about.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan::testing {

// Units: mm. x along the axle, z up, origin in the middle.
struct AxleSize {
  double total_length_mm = 1888.4;
  double left_width_mm = 178.9;
  double right_width_mm = 177.4;
  double left_diameter_mm = 89.7;
  double right_diameter_mm = 88.5;
};

// Writes the axle as STEP with names on the faces that dimensions use. Errors: kIo, kDegenerate from
// OpenCASCADE.
Status WriteAxleStep(const AxleSize& size, const std::filesystem::path& path);

// The axle as imported model, through a STEP file in the test's temporary folder.
Result<ModelBundle> MakeAxle(const AxleSize& size, double spacing_mm);

// The sizes of the plain axle that AxleFeatures() knows.
inline const std::vector<std::string> kAxleDimensions = {
    "total length", "left plate width", "right plate width", "left diameter", "right diameter"};

// Text of a features.toml with these dimensions, in this order; limits 0.5 mm or 1 mm about the nominal size.
std::string AxleFeatures(const std::vector<std::string>& names);

struct ScanOptions {
  std::size_t points = 60'000;
  double foreign_share = 0.22;  // conveyor below the part and a clamp about the beam
  double noise_mm = 0.03;       // standard deviation along the normal
  std::uint64_t seed = 1;
  bool from_all_sides = true;   // else nothing that faces down by more than 45 degrees
  double normal_noise_rad = 0;  // standard deviation of a normal, about each of two axes across it
};

// Frames: model. Points lie on the model's triangles but for noise; normals are those of the surface but for
// theirs, which changes no point.
PointCloud ScanOf(const ModelBundle& model, const ScanOptions& options);

PointCloud Moved(const PointCloud& cloud, const Eigen::Isometry3d& to_from_cloud);

// A turn of angle_rad about a random axis through `center` and a shift of shift_mm in a random direction.
Eigen::Isometry3d RandomMotion(const Eigen::Vector3d& center, double angle_rad, double shift_mm,
                               std::uint64_t seed);

}  // namespace forgescan::testing
