// The points of a scan that a stage of the registration works on.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "services/common/geometry/point_cloud.h"
#include "services/registration/registration_model.h"

namespace forgescan {

// Shape: normals has the length of points, or 0. Units: mm; normals of length 1. Frames: scan.
struct ScanSample {
  std::vector<Eigen::Vector3f> points, normals;
  std::size_t size() const { return points.size(); }
};

// Numbers of the finite points that lie, moved by start, in the model's box grown by margin_mm; ascending.
// The same for any number of threads.
std::vector<std::uint32_t> FindInBox(const PointCloud& scan, const RegistrationModel& model,
                                     const Eigen::Isometry3d& start, double margin_mm, unsigned threads);

// One of every n of the numbered points, with the smallest n that takes at most max_points; not always the
// same one of them, but the same in every run. Points whose normal has no direction are left out.
ScanSample TakeSample(const PointCloud& scan, const std::vector<std::uint32_t>& indices,
                      std::size_t max_points);

}  // namespace forgescan
