// Slope of a disparity map, the raw material of normals.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>

namespace forgescan {

// Least-squares slope from symmetric pairs of pixels (x - k, x + k), k = 1..radius, averaged over 2 radius +
// 1 parallel lines. A pair counts only if both have a disparity and differ by no more than a surface at the
// largest view angle would.
class DisparityGradient {
 public:
  struct Options {
    int radius_px;
    double max_slope_ratio;  // largest |gradient| over disparity, 1 / px
    int threads;
  };
  DisparityGradient(const cv::Mat_<float>& disparity_px, const Options& options);

  // px per px along x and y; nullopt when less than a third of the pairs is there.
  std::optional<Eigen::Vector2f> At(int row, int column) const;

 private:
  void SumPairs(const cv::Mat_<float>& disparity_px, int row, float max_slope_ratio);

  int radius_px_;
  float full_weight_;            // what all pairs of a window would weigh
  cv::Mat_<cv::Vec2f> along_x_;  // per pixel: sum of k * difference, sum of 2 k^2
  cv::Mat_<cv::Vec2f> along_y_;
};

}  // namespace forgescan
