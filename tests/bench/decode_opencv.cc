#include "tests/bench/decode_opencv.h"

#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace forgescan {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr int kThreeFrames = 1;  // index of the frequency with three frames; its frames are 2, 3, 4

}  // namespace

OpenCvDecoder::OpenCvDecoder(const FringeDecoder& decoder, const ReconstructionConfig& config)
    : decoder_(decoder), config_(config), orders_(FringeOrderTable::kSide, FringeOrderTable::kSide, CV_32F) {
  for (int y = 0; y < FringeOrderTable::kSide; ++y) {
    for (int x = 0; x < FringeOrderTable::kSide; ++x) {
      const auto entry = decoder.table().cells[static_cast<std::size_t>(y * FringeOrderTable::kSide + x)];
      orders_.at<float>(y, x) =
          entry.is_doubtful != 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(entry.order);
    }
  }
}

void OpenCvDecoder::Decode(std::span<const cv::Mat> frames, cv::Mat coordinate_px, cv::Mat valid) {
  Phases(frames);
  Unwrap();
  Fuse(coordinate_px);
  Masks(frames, coordinate_px, valid);
}

// Eq. (4): everything times 2.
void OpenCvDecoder::Phases(std::span<const cv::Mat> frames) {
  for (std::size_t i = 0; i < 7; ++i) {
    frames[i].convertTo(grey_[i], CV_32F);
  }
  cv::add(grey_[2], grey_[4], twice_background_);
  cv::subtract(grey_[2], grey_[4], cosine_);
  cv::scaleAdd(grey_[3], -2, twice_background_, sine_);
  cv::cartToPolar(cosine_, sine_, modulation_[kThreeFrames], turns_[kThreeFrames]);
  for (const std::size_t first : {0U, 5U}) {
    const std::size_t frequency = first == 0 ? 0 : 2;
    cv::addWeighted(grey_[first], 2, twice_background_, -1, 0, cosine_);
    cv::scaleAdd(grey_[first + 1], -2, twice_background_, sine_);
    cv::cartToPolar(cosine_, sine_, modulation_[frequency], turns_[frequency]);
  }
}

void OpenCvDecoder::Unwrap() {
  const FringeOrderTable& table = decoder_.table();
  constexpr double kCells = FringeOrderTable::kSide / kTwoPi;
  for (std::size_t o = 0; o < 2; ++o) {
    const auto j = static_cast<std::size_t>(table.others[o]);
    cv::addWeighted(turns_[j], kCells, turns_[kThreeFrames], -kCells * static_cast<double>(table.ratios[o]),
                    -0.5, difference_[o]);
  }
  cv::remap(orders_, order_, difference_[0], difference_[1], cv::INTER_NEAREST, cv::BORDER_WRAP);
  cv::scaleAdd(order_, kTwoPi, turns_[kThreeFrames], base_);
}

void OpenCvDecoder::Fuse(cv::Mat& coordinate_px) {
  const FringeOrderTable& table = decoder_.table();
  const PatternSet& pattern = decoder_.pattern();
  base_.convertTo(coordinate_px, CV_32F, pattern.frequencies[kThreeFrames].period_px / kTwoPi,
                  pattern.phase_origin_px);
  for (std::size_t o = 0; o < 2; ++o) {
    const auto j = static_cast<std::size_t>(table.others[o]);
    cv::addWeighted(base_, static_cast<double>(table.ratios[o]) / kTwoPi, turns_[j], -1 / kTwoPi, 0, off_);
    off_.convertTo(whole_, CV_32S);  // rounds
    whole_.convertTo(whole_, CV_32F);
    cv::subtract(off_, whole_, off_);
    cv::scaleAdd(off_, -decoder_.estimator().fusion[j] * pattern.frequencies[j].period_px, coordinate_px,
                 coordinate_px);
  }
}

void OpenCvDecoder::Masks(std::span<const cv::Mat> frames, const cv::Mat& coordinate_px, cv::Mat& valid) {
  cv::max(frames[0], frames[1], peak_);
  for (std::size_t i = 2; i < 7; ++i) {
    cv::max(peak_, frames[i], peak_);
  }
  cv::compare(peak_, config_.saturation_fraction * 255, valid, cv::CMP_LT);
  cv::min(modulation_[0], modulation_[1], least_);
  cv::min(least_, modulation_[2], least_);
  cv::compare(least_, 2 * config_.min_modulation_dn, mask_, cv::CMP_GE);
  cv::bitwise_and(valid, mask_, valid);
  cv::inRange(coordinate_px, decoder_.table().first_px, decoder_.table().last_px, mask_);  // NaN is outside
  cv::bitwise_and(valid, mask_, valid);
}

}  // namespace forgescan
