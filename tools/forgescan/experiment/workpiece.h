// Parts with what lies about them, and scans of both as points: the ground truth of the registration
// experiments.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "services/common/geometry/point_cloud.h"
#include "services/common/model/model_bundle.h"
#include "services/registration/registration_model.h"
#include "tools/virtual_station/random.h"
#include "tools/virtual_station/surface_mesh.h"

namespace forgescan {

// Frames: everything in the model's, mm. Read-only: any number of threads.
struct Workpiece {
  std::string name;
  ModelBundle bundle;
  RegistrationModel model;
  SurfaceMesh clutter;
  Eigen::AlignedBox3d hidden;  // no clutter is seen in here: the part stands on it; empty: nowhere
};

// The axle of the virtual cell (through its STEP file, as a station's model is made) on conveyor, rests and
// clamp. Cost: 4 s. Errors: those of the cell's file, of the CAD model and its import.
Result<Workpiece> MakeAxleInClamp(const std::string& cell_file);
// A cover of 240 x 160 mm with two humps, one surface without faces, that lies on a platform.
Result<Workpiece> MakeCoverOnPlatform();

struct ScanRequest {
  std::size_t points = 60'000;
  double foreign_share = 0.22;  // of the points; within 100 mm of the part's box
  double noise_mm = 0.03;       // standard deviation along the normal
  std::uint64_t seed = 1;
  int run = 0;  // selects the draw
};

// Points with normals, evenly over what is seen: nothing that faces down by more than 45 degrees.
PointCloud SampleScan(const Workpiece& workpiece, const ScanRequest& request);

PointCloud MovedCloud(const PointCloud& cloud, const Eigen::Isometry3d& to_from_cloud);

// How far a part lies from where the station expects it: a turn of angle_rad about a random axis through
// `center` and a shift of shift_mm in a random direction.
Eigen::Isometry3d RandomOffset(const Eigen::Vector3d& center, double angle_rad, double shift_mm,
                               RandomStream& random);

}  // namespace forgescan
