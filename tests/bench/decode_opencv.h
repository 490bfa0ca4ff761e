// What a good user of OpenCV writes for the 3-2-2 set: whole arrays, one library call for each operation.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>

#include "services/reconstruction/fringe_decoder.h"

namespace forgescan {

// Buffers are kept from call to call, so that the peer does not pay for fresh memory either. Only for the
// shared set of StationPattern(): Eq. (4) of the paper. The fringe order comes from the same joint table as
// ours, looked up by cv::remap.
class OpenCvDecoder {
 public:
  OpenCvDecoder(const FringeDecoder& decoder, const ReconstructionConfig& config);
  // Shape: 8 frames CV_8UC1. Results: coordinate_px (CV_32F) and valid (255 or 0).
  void Decode(std::span<const cv::Mat> frames, cv::Mat coordinate_px, cv::Mat valid);

 private:
  void Phases(std::span<const cv::Mat> frames);
  void Unwrap();
  void Fuse(cv::Mat& coordinate_px);
  void Masks(std::span<const cv::Mat> frames, const cv::Mat& coordinate_px, cv::Mat& valid);

  const FringeDecoder& decoder_;
  ReconstructionConfig config_;
  cv::Mat orders_;  // the table; NaN where doubtful
  cv::Mat grey_[7], twice_background_, cosine_, sine_, turns_[3], modulation_[3];
  cv::Mat difference_[2], order_, base_, off_, whole_, least_, peak_, mask_;
};

}  // namespace forgescan
