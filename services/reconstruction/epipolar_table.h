// Where the epipolar lines of a rectified pair run through the raw images.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "services/common/imaging/stereo_calibration.h"
#include "services/common/result.h"
#include "services/reconstruction/stereo/kernel.h"

namespace forgescan {

// Shape: for every rectified row of the frame the blocks of 16 raw columns along its line, as far as they are
// in the rectified frame, up to a block. Within a block raw row and rectified column are parabolas through
// columns 0, 8 and 16; at 5 MP they are off by less than 0.001 px. Frames: rectified columns are measured
// from the principal point. 28 bytes a block: 8.8 MB for a camera of 5 MP.
class EpipolarTable {
 public:
  EpipolarTable() = default;
  // rectification, projection: of this camera, as from cv::stereoRectify. Errors: kInvalidArgument when a
  // rectified row runs backwards through the raw image.
  static Result<EpipolarTable> Build(const CameraIntrinsics& camera, const cv::Mat& rectification,
                                     const cv::Mat& projection, ImageSize size);

  const EpipolarBlock* Row(int row) const {
    return &blocks_[static_cast<std::size_t>(row) * static_cast<std::size_t>(blocks_a_row_)];
  }
  int blocks_a_row() const { return blocks_a_row_; }
  ImageSize size() const { return size_; }

 private:
  ImageSize size_;
  int blocks_a_row_ = 0;
  std::vector<EpipolarBlock> blocks_;
};

}  // namespace forgescan
