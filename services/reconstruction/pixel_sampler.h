// Grey values and phasors of single pixels, for figures that need a few thousand of them.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "services/reconstruction/phase_estimator.h"

namespace forgescan {

// Distance, px, of the samples of a regular grid that has about 20,000 of them.
inline int SamplingStep(cv::Size size) {
  constexpr double kSamples = 20000;
  return std::max(1, static_cast<int>(std::sqrt(static_cast<double>(size.area()) / kSamples)));
}

// Results hold until the next call.
class PixelSampler {
 public:
  // scale: to 8-bit DN.
  PixelSampler(std::span<const cv::Mat> frames, const PhaseEstimator& estimator, double scale)
      : frames_(frames),
        estimator_(estimator),
        scale_(scale),
        grey_(static_cast<Eigen::Index>(frames.size())),
        phasors_(static_cast<std::size_t>(estimator.cosine.rows())) {}

  const Eigen::VectorXd& Grey(int row, int column) {
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const cv::Mat& frame = frames_[i];
      grey_(static_cast<Eigen::Index>(i)) =
          scale_ * (frame.depth() == CV_8U ? frame.at<std::uint8_t>(row, column)
                                           : frame.at<std::uint16_t>(row, column));
    }
    return grey_;
  }

  // B exp(i phi) of the frequencies, DN.
  const std::vector<std::complex<double>>& Phasors(int row, int column) {
    const Eigen::VectorXd& grey = Grey(row, column);
    for (std::size_t j = 0; j < phasors_.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      phasors_[j] = {estimator_.cosine.row(at).dot(grey), estimator_.sine.row(at).dot(grey)};
    }
    return phasors_;
  }

  double LeastModulation(int row, int column) {
    double least = 1e9;
    for (const std::complex<double>& phasor : Phasors(row, column)) {
      least = std::min(least, std::norm(phasor));
    }
    return std::sqrt(least);
  }

 private:
  std::span<const cv::Mat> frames_;
  const PhaseEstimator& estimator_;
  double scale_;
  Eigen::VectorXd grey_;
  std::vector<std::complex<double>> phasors_;
};

}  // namespace forgescan
