#include "tools/forgescan/experiment/set_comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/virtual_station/commissioning.h"
#include "tools/virtual_station/teaching.h"

namespace forgescan {
namespace {

constexpr int kView = 1;  // of the cell's path: a plate, the beam and a bracket from the side
constexpr int kSteps = 4;

// The same frequencies, four frames each, and the white frame last.
PatternSet FullSet(const PatternSet& reduced) {
  PatternSet full = reduced;
  full.background = Background::kOwn;
  full.frame_names.clear();
  for (FringeFrequency& frequency : full.frequencies) {
    frequency.frame_index.clear();
    frequency.shift_rad.clear();
    for (int i = 0; i < kSteps; ++i) {
      frequency.frame_index.push_back(full.frame_count());
      frequency.shift_rad.push_back(0.5 * std::numbers::pi * i);
      full.frame_names.push_back(fmt::format("full_{:02}", full.frame_count()));
    }
  }
  full.reference_frame_index = full.frame_count();
  full.frame_names.emplace_back("full_white");
  return full;
}

std::vector<Pattern> PatternsOf(const PatternSet& set) {
  std::vector<Pattern> patterns(static_cast<std::size_t>(set.frame_count()));
  for (const FringeFrequency& frequency : set.frequencies) {
    for (std::size_t i = 0; i < frequency.frame_index.size(); ++i) {
      patterns[static_cast<std::size_t>(frequency.frame_index[i])] = {
          frequency.period_px, frequency.shift_rad[i] * 180 / std::numbers::pi};
    }
  }
  return patterns;
}

Result<std::vector<int>> FramesOfReduced(const PatternSet& reduced, const PatternSet& full) {
  std::vector<int> frames(static_cast<std::size_t>(reduced.frame_count()), full.frame_count() - 1);
  for (std::size_t j = 0; j < reduced.frequencies.size(); ++j) {
    const FringeFrequency& some = reduced.frequencies[j];
    const FringeFrequency& all = full.frequencies[j];
    for (std::size_t i = 0; i < some.frame_index.size(); ++i) {
      const auto found = std::find_if(all.shift_rad.begin(), all.shift_rad.end(), [&](double shift) {
        return std::abs(shift - some.shift_rad[i]) < 1e-6;
      });
      if (found == all.shift_rad.end()) {
        return Fail(ErrorCode::kInvalidArgument, "the pattern has a shift of {} rad, not a quarter of a turn",
                    some.shift_rad[i]);
      }
      frames[static_cast<std::size_t>(some.frame_index[i])] =
          all.frame_index[static_cast<std::size_t>(found - all.shift_rad.begin())];
    }
  }
  return frames;
}

// Rectified left pixel of a point in its own camera frame.
int PixelOf(const Eigen::Vector3f& p, const StereoRig& rig) {
  const double z = static_cast<double>(p.z());
  const int x =
      static_cast<int>(std::lround(rig.focal_px * static_cast<double>(p.x()) / z + rig.left_center_x_px));
  const int y =
      static_cast<int>(std::lround(rig.focal_px * static_cast<double>(p.y()) / z + rig.center_y_px));
  return y * rig.size().width_px + x;
}

std::vector<int> IndexByPixel(const PointCloud& cloud, const StereoRig& rig) {
  std::vector<int> index(
      static_cast<std::size_t>(rig.size().width_px) * static_cast<std::size_t>(rig.size().height_px), -1);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const int pixel = PixelOf(cloud.points[i], rig);
    if (pixel >= 0 && static_cast<std::size_t>(pixel) < index.size()) {
      index[static_cast<std::size_t>(pixel)] = static_cast<int>(i);
    }
  }
  return index;
}

// sigma / B from the four frames of the finest frequency.
double NoiseShare(const std::vector<cv::Mat>& frames, const FringeFrequency& finest, const CameraNoise& noise,
                  const Eigen::Vector2d& raw) {
  std::array<double, kSteps> grey{};
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const cv::Mat& frame = frames[static_cast<std::size_t>(finest.frame_index[i])];
    const int x = std::clamp(static_cast<int>(std::lround(raw[0])), 0, frame.cols - 1);
    const int y = std::clamp(static_cast<int>(std::lround(raw[1])), 0, frame.rows - 1);
    grey[i] = frame.at<std::uint8_t>(y, x);
  }
  const double mean = 0.25 * (grey[0] + grey[1] + grey[2] + grey[3]);
  const double modulation = 0.5 * std::hypot(grey[0] - grey[2], grey[3] - grey[1]);
  return std::sqrt(noise.read_noise_dn * noise.read_noise_dn + noise.gain_dn * mean) /
         std::max(modulation, 1e-3);
}

double MedianShare(std::vector<ComparedPoint> points) {
  if (points.empty()) return 0;
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
  std::nth_element(points.begin(), middle, points.end(),
                   [](const auto& a, const auto& b) { return a.noise_share < b.noise_share; });
  return middle->noise_share;
}

}  // namespace

Result<SetComparer> SetComparer::Create(const CellConfig& config, const ExperimentOptions& options) {
  SetComparer comparer;
  comparer.config_ = config;
  comparer.threads_ = options.threads;
  ASSIGN_OR_RETURN(comparer.files_, Commission(config, options));
  comparer.full_ = FullSet(comparer.files_.pattern);
  ASSIGN_OR_RETURN(comparer.reduced_of_full_, FramesOfReduced(comparer.files_.pattern, comparer.full_));
  const Rig calibrated = CalibratedRig(config);  // as commissioning has written it
  comparer.left_lens_ = calibrated.left.lens;
  comparer.left_from_rectified_ = Rectify(calibrated).rectified_from_left.transpose();
  const VirtualCell cell(config, options.threads);
  ASSIGN_OR_RETURN(const PartState part, cell.Part(0));
  ASSIGN_OR_RETURN(const ViewState view, cell.View(part, kView));
  for (const Side side : {Side::kLeft, Side::kRight}) {
    ASSIGN_OR_RETURN(comparer.maps_[static_cast<std::size_t>(side)], cell.Map(part, view, side));
  }
  return comparer;
}

Eigen::Vector2d SetComparer::RawPixel(const Eigen::Vector3f& p_in_camera) const {
  return Project(left_lens_, left_from_rectified_ * p_in_camera.cast<double>());
}

Result<Comparison> SetComparer::Compare(double noise_factor) const {
  CellConfig config = config_;
  config.sensor.read_noise_dn *= noise_factor;
  config.sensor.gain_dn *= noise_factor * noise_factor;
  const MeasuredNoise noise = MeasureNoise(config);
  ReconstructionConfig settings = files_.reconstruction.reconstruction;
  settings.noise = {noise.read_dn, noise.gain_dn};
  std::array<std::vector<cv::Mat>, 2> full;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    full[static_cast<std::size_t>(side)] =
        ExposeAll(maps_[static_cast<std::size_t>(side)], config, PatternsOf(full_),
                  {config.seed, 0, kView, 0, side, 0}, threads_);
  }
  return Match(config, settings, full);
}

Result<Comparison> SetComparer::Match(const CellConfig& config, const ReconstructionConfig& settings,
                                      const std::array<std::vector<cv::Mat>, 2>& full) const {
  std::array<std::vector<cv::Mat>, 2> reduced;
  for (std::size_t side = 0; side < 2; ++side) {
    for (const int frame : reduced_of_full_)
      reduced[side].push_back(full[side][static_cast<std::size_t>(frame)]);
  }
  const ImageSize size{config.rig.left.width_px, config.rig.left.height_px};
  ASSIGN_OR_RETURN(const auto by_full, Reconstructor::Create(full_, files_.calibration, size, settings));
  ASSIGN_OR_RETURN(const auto by_reduced,
                   Reconstructor::Create(files_.pattern, files_.calibration, size, settings));
  ASSIGN_OR_RETURN(const Reconstruction a, by_full.Run(full[0], full[1]));
  ASSIGN_OR_RETURN(const Reconstruction b, by_reduced.Run(reduced[0], reduced[1]));
  const StereoRig& rig = by_full.rig();
  const std::vector<int> index = IndexByPixel(a.cloud_in_camera, rig);
  const FringeFrequency& finest = full_.frequencies[static_cast<std::size_t>(by_full.decoder().table().base)];
  Comparison comparison{size, {}, 0, 0, 0};
  for (std::size_t i = 0; i < b.cloud_in_camera.size(); ++i) {
    const int pixel = PixelOf(b.cloud_in_camera.points[i], rig);
    if (pixel < 0 || static_cast<std::size_t>(pixel) >= index.size()) continue;
    const int other = index[static_cast<std::size_t>(pixel)];
    if (other < 0) {
      ++comparison.only_reduced;
      continue;
    }
    const auto j = static_cast<std::size_t>(other);
    const double full_mm = static_cast<double>(a.cloud_in_camera.points[j].norm());
    const double reduced_mm = static_cast<double>(b.cloud_in_camera.points[i].norm());
    const double full_sigma = static_cast<double>(a.cloud_in_camera.sigma_mm[j]);
    const double reduced_sigma = static_cast<double>(b.cloud_in_camera.sigma_mm[i]);
    // The full set uses the frames as well as they can be used, so its error is not correlated with what
    // the reduced set adds to it.
    const double predicted =
        std::sqrt(std::max(reduced_sigma * reduced_sigma - full_sigma * full_sigma, 1e-12));
    const int x = pixel % size.width_px, y = pixel / size.width_px;
    comparison.points.push_back(
        {x, y, reduced_mm - full_mm, predicted,
         NoiseShare(full[0], finest, settings.noise, RawPixel(b.cloud_in_camera.points[i]))});
  }
  comparison.only_full = a.cloud_in_camera.size() - comparison.points.size();
  comparison.median_noise_share = MedianShare(comparison.points);
  return comparison;
}

}  // namespace forgescan
