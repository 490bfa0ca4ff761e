// A set of surface points, the currency between reconstruction, fusion, registration and report.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace forgescan {

// Shape: points has n entries; every other member has n entries or none. Units: mm; normals have length 1.
// Frames: a cloud is in ONE frame, named by the variable that holds it (cloud_in_camera, cloud_in_array,
// cloud_in_model). float: 1e-4 mm over a 2 m part, a hundredth of what the scanner resolves.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;  // towards the camera that saw the point
  std::vector<float> sigma_mm;           // predicted standard deviation of a point, along its view ray
  std::vector<std::uint16_t> view;       // index of the view a point was seen in

  std::size_t size() const { return points.size(); }
  bool empty() const { return points.empty(); }
};

}  // namespace forgescan
