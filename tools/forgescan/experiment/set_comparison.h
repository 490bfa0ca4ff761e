// The same scene reconstructed from all frames of the full set and from the seven of them that make the
// reduced set: where, and by how much, the points differ.
#pragma once

#include <memory>

#include "tools/forgescan/experiment/virtual_inspection.h"

namespace forgescan {

// A rectified left pixel that has a point in both clouds.
struct ComparedPoint {
  int x = 0, y = 0;          // rectified left pixel
  double difference_mm = 0;  // reduced less full, along the view ray; + is farther
  double predicted_mm = 0;   // standard deviation of it, by the points' own
  double noise_share = 0;    // sigma / B of the finest frequency there, from the frames
};

struct Comparison {
  ImageSize size;
  std::vector<ComparedPoint> points;
  double median_noise_share = 0;
  std::size_t only_full = 0, only_reduced = 0;  // points without a partner
};

// One view of the axle; its geometry is traced once, then exposed with any camera noise.
class SetComparer {
 public:
  static Result<SetComparer> Create(const CellConfig& config, const ExperimentOptions& options);
  // noise_factor: of the cameras' noise against the cell's; the reconstruction is told, as commissioning
  // measures it.
  Result<Comparison> Compare(double noise_factor) const;

 private:
  SetComparer() = default;
  Result<Comparison> Match(const CellConfig& config, const ReconstructionConfig& settings,
                           const std::array<std::vector<cv::Mat>, 2>& full) const;

  // Raw left pixel of a point in the rectified left camera, by the written calibration.
  Eigen::Vector2d RawPixel(const Eigen::Vector3f& p_in_camera) const;

  CellConfig config_;
  Lens left_lens_;
  Eigen::Matrix3d left_from_rectified_ = Eigen::Matrix3d::Identity();
  int threads_ = 1;
  StationFiles files_;
  PatternSet full_;
  std::vector<int> reduced_of_full_;  // frame of the full set for each frame of the reduced one
  std::array<GeometryMap, 2> maps_;
};

}  // namespace forgescan
