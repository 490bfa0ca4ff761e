// From two decoded views of 2448 x 2048 px to points, beside row-wise interpolation with binary search.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/reconstruction/reconstruct.h"
#include "services/reconstruction/stereo_points.h"
#include "services/reconstruction/stereo_rig.h"
#include "tests/bench/stereo_scene.h"

namespace forgescan::bench {
namespace {

template <typename T>
T Must(Result<T> result) {
  if (!result.ok()) {
    throw std::runtime_error(result.error().message);
  }
  return std::move(result).value();
}

struct Case {
  StereoCalibration calibration = BenchRig();
  StereoRig rig;
  Eigen::Matrix3d left_from_rectified = RectifiedFromLeft(calibration).transpose();
  DecodedScene scene = BenchScene();
  DecodedView left = SeeDecoded(scene, calibration.left, PoseFromLeft{}, calibration, 1);
  DecodedView right = SeeDecoded(scene, calibration.right, calibration.right_from_left, calibration, 2);

  Case() {
    StereoCalibration cameras = calibration;
    cameras.projector.reset();  // the peer has no such check either
    rig = Must(MakeStereoRig(cameras, *calibration.image_size));
  }

  // How far a point is behind the surface, along z of the rectified camera.
  double DepthError(const Eigen::Vector3d& p_in_camera) const {
    const Eigen::Vector3d ray = p_in_camera / p_in_camera.z();
    return p_in_camera.z() - scene.hit(Eigen::Vector3d::Zero(), left_from_rectified * ray);
  }
};

const Case& TheCase() {
  static const Case only;
  return only;
}

double MedianSize(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::transform(values.begin(), values.end(), values.begin(), [](double value) { return std::abs(value); });
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Median of the sizes, and the share beyond 4 sigma + 0.05 mm, sigma about 0.01 mm here.
void Report(const std::vector<double>& errors_mm, std::size_t points, benchmark::State& state) {
  const auto flying =
      std::count_if(errors_mm.begin(), errors_mm.end(), [](double e) { return std::abs(e) > 0.1; });
  state.counters["median_depth_error_um"] = 1000 * MedianSize(errors_mm);
  state.counters["flying_ppm"] = 1e6 * static_cast<double>(flying) / static_cast<double>(errors_mm.size());
  state.counters["points"] = static_cast<double>(points);
}

constexpr float kMasked = -1e6F;  // so far off that a mix of it and a coordinate is known again

// The usual way: both coordinate maps rectified by cv::remap, then for each row and left pixel a binary
// search among the right row's pixels, linear between two of them, and depth from the disparity. No checks,
// no normals, no uncertainty.
class RowSearch {
 public:
  explicit RowSearch(const Case& c) : c_(c) {
    Maps(c.calibration);
    left_ = c.left.coordinate_px.clone();
    left_.setTo(kMasked, c.left.cause != 0);
    right_ = c.right.coordinate_px.clone();
    right_.setTo(kMasked, c.right.cause != 0);
  }

  const cv::Mat_<float>& Run() {
    cv::remap(left_, left_rectified_, left_x_, left_y_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, kMasked);
    cv::remap(right_, right_rectified_, right_x_, right_y_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, kMasked);
    depth_mm_.create(left_.size());
    for (int row = 0; row < left_.rows; ++row) {
      Row(row);
    }
    return depth_mm_;
  }

 private:
  void Maps(const StereoCalibration& calibration) {
    cv::Mat kl, kr, r, t, r1, r2, p1, p2, q;
    cv::eigen2cv(calibration.left.camera_matrix, kl);
    cv::eigen2cv(calibration.right.camera_matrix, kr);
    cv::eigen2cv(calibration.right_from_left.rotation, r);
    cv::eigen2cv(calibration.right_from_left.translation_mm, t);
    const cv::Size size = c_.left.cause.size();
    cv::stereoRectify(kl, calibration.left.distortion, kr, calibration.right.distortion, size, r, t, r1, r2,
                      p1, p2, q);
    cv::initUndistortRectifyMap(kl, calibration.left.distortion, r1, p1, size, CV_32FC1, left_x_, left_y_);
    cv::initUndistortRectifyMap(kr, calibration.right.distortion, r2, p2, size, CV_32FC1, right_x_, right_y_);
  }

  void Row(int row) {
    const float* const right = right_rectified_[row];
    coordinates_.clear();
    columns_.clear();
    for (int x = 0; x < right_rectified_.cols; ++x) {
      if (right[x] > 0) {
        coordinates_.push_back(right[x]);
        columns_.push_back(static_cast<float>(x));
      }
    }
    const auto depth = static_cast<float>(c_.rig.focal_px * c_.rig.baseline_mm);
    const auto shift = static_cast<float>(c_.rig.left_center_x_px - c_.rig.right_center_x_px);
    for (int x = 0; x < left_rectified_.cols; ++x) {
      const float wanted = left_rectified_(row, x);
      const auto above =
          std::upper_bound(coordinates_.begin(), coordinates_.end(), wanted) - coordinates_.begin();
      depth_mm_(row, x) = 0;
      if (wanted > 0 && above > 0 && above < std::ssize(coordinates_)) {
        const auto at = static_cast<std::size_t>(above);
        const float part = (wanted - coordinates_[at - 1]) / (coordinates_[at] - coordinates_[at - 1]);
        const float partner = columns_[at - 1] + part * (columns_[at] - columns_[at - 1]);
        depth_mm_(row, x) = depth / (static_cast<float>(x) - partner - shift);
      }
    }
  }

  const Case& c_;
  cv::Mat left_x_, left_y_, right_x_, right_y_;
  cv::Mat_<float> left_, right_, left_rectified_, right_rectified_, depth_mm_;
  std::vector<float> coordinates_, columns_;
};

std::vector<double> DepthErrors(const Case& c, const cv::Mat_<float>& depth_mm) {
  std::vector<double> errors;
  for (int i = 0; i < static_cast<int>(depth_mm.total()); i += 41) {
    const int row = i / depth_mm.cols, column = i % depth_mm.cols;
    const double z = static_cast<double>(depth_mm(row, column));
    if (z > 0) {
      const Eigen::Vector3d ray((column - c.rig.left_center_x_px) / c.rig.focal_px,
                                (row - c.rig.center_y_px) / c.rig.focal_px, 1);
      errors.push_back(c.DepthError(z * ray));
    }
  }
  return errors;
}

void BM_RowSearch(benchmark::State& state) {
  const Case& c = TheCase();
  cv::setNumThreads(1);
  RowSearch search(c);
  cv::Mat_<float> depth_mm = search.Run();
  for (auto _ : state) {
    depth_mm = search.Run();
  }
  const auto points = std::count_if(depth_mm.begin(), depth_mm.end(), [](float z) { return z > 0; });
  Report(DepthErrors(c, depth_mm), static_cast<std::size_t>(points), state);
}

// Faster does not count where the depths are worse.
void FailIfWorse(double median_error_mm, benchmark::State& state) {
  const Case& c = TheCase();
  static const double peer_mm = MedianSize(DepthErrors(c, RowSearch(c).Run()));
  if (!(median_error_mm <= peer_mm)) {
    state.SkipWithError("the median depth error is larger than that of the search row by row");
  }
}

void BM_Ours(benchmark::State& state, int threads, int keep_every_nth_point) {
  const Case& c = TheCase();
  ReconstructionConfig config;
  config.threads = threads;
  config.keep_every_nth_point = keep_every_nth_point;
  StereoPoints result = Must(ComputeStereoPoints(c.left, c.right, c.rig, config));
  for (auto _ : state) {
    result = Must(ComputeStereoPoints(c.left, c.right, c.rig, config, std::move(result)));
  }
  std::vector<double> errors;
  for (std::size_t i = 0; i < result.cloud_in_camera.size(); i += 41) {
    errors.push_back(c.DepthError(result.cloud_in_camera.points[i].cast<double>()));
  }
  Report(errors, result.cloud_in_camera.size(), state);
  FailIfWorse(MedianSize(errors), state);
}

// Frames of the virtual station's set: 64, 63 and 56 fringes on 1984 px in 3 + 2 + 2 frames.
PatternSet Fringes() {
  PatternSet pattern;
  pattern.projector_width_px = 1920;
  pattern.background = Background::kShared;
  for (const double fringes : {64.0, 63.0, 56.0}) {
    FringeFrequency frequency;
    frequency.period_px = 1984 / fringes;
    for (int i = 0; i < (fringes == 64.0 ? 3 : 2); ++i) {
      frequency.frame_index.push_back(pattern.frame_count());
      frequency.shift_rad.push_back(i * std::numbers::pi / 2);
      pattern.frame_names.push_back(std::to_string(pattern.frame_count()));
    }
    pattern.frequencies.push_back(frequency);
  }
  return pattern;
}

std::vector<cv::Mat> Photograph(const DecodedView& view, const PatternSet& pattern, std::uint64_t seed) {
  std::vector<cv::Mat> frames(static_cast<std::size_t>(pattern.frame_count()));
  cv::RNG random(seed);
  for (const FringeFrequency& frequency : pattern.frequencies) {
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      cv::Mat noise(view.cause.size(), CV_32F);
      random.fill(noise, cv::RNG::NORMAL, 0, 1.2);
      cv::Mat& frame = frames[static_cast<std::size_t>(frequency.frame_index[i])];
      frame.create(view.cause.size(), CV_8UC1);
      for (int y = 0; y < frame.rows; ++y) {
        for (int x = 0; x < frame.cols; ++x) {
          const double angle =
              2 * std::numbers::pi * static_cast<double>(view.coordinate_px(y, x)) / frequency.period_px;
          const bool lit = view.coordinate_px(y, x) > 0;
          const double grey = lit ? 110 + 80 * std::cos(angle + frequency.shift_rad[i]) : 15;
          frame.at<std::uint8_t>(y, x) =
              cv::saturate_cast<std::uint8_t>(grey + static_cast<double>(noise.at<float>(y, x)));
        }
      }
    }
  }
  return frames;
}

struct Pictures {
  PatternSet pattern = Fringes();
  std::vector<cv::Mat> left, right;

  Pictures() {
    const Case& c = TheCase();
    DecodedScene scene = c.scene;
    scene.noise_px = 0;
    scene.keeps_masked = true;
    const auto& rig = c.calibration;
    left = Photograph(SeeDecoded(scene, rig.left, PoseFromLeft{}, rig, 1), pattern, 1);
    right = Photograph(SeeDecoded(scene, rig.right, rig.right_from_left, rig, 2), pattern, 2);
  }
};

// A whole view as the service runs it: decoding of both cameras, trust, points with the projector's check,
// one in 8 kept.
void BM_View(benchmark::State& state, int threads) {
  static const Pictures pictures;
  const Case& c = TheCase();
  ReconstructionConfig config;
  config.noise = {.read_noise_dn = 1.2, .gain_dn = 0};
  config.keep_every_nth_point = 8;
  config.threads = threads;
  const auto reconstructor =
      Must(Reconstructor::Create(pictures.pattern, c.calibration, *c.calibration.image_size, config));
  Result<Reconstruction> result = reconstructor.Run(pictures.left, pictures.right);
  for (auto _ : state) {
    result = reconstructor.Run(pictures.left, pictures.right);
  }
  if (!result.ok()) {
    state.SkipWithError(result.error().message.c_str());
    return;
  }
  std::vector<double> errors;
  for (std::size_t i = 0; i < result->cloud_in_camera.size(); i += 11) {
    errors.push_back(c.DepthError(result->cloud_in_camera.points[i].cast<double>()));
  }
  Report(errors, static_cast<std::size_t>(result->quality.stereo.points), state);
}

BENCHMARK_CAPTURE(BM_Ours, one, 1, 1)->Name("stereo/ours")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_Ours, two, 2, 1)
    ->Name("stereo/ours/threads:2")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(BM_Ours, kept, 1, 8)
    ->Name("stereo/ours_keeping_1_in_8")
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(BM_RowSearch)->Name("stereo/row_search")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_View, one, 1)->Name("view/ours")->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_View, two, 2)->Name("view/ours/threads:2")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace forgescan::bench

BENCHMARK_MAIN();
