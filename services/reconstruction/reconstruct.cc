#include "services/reconstruction/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <utility>

#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/stereo_points.h"

namespace forgescan {
namespace {

Error InCamera(const char* name, const Error& error) {
  return Error{error.code, fmt::format("{} camera: {}", name, error.message), error.where};
}

// Two cameras never see the same noise: equal frames are one camera given twice. Ends with the first row that
// differs.
bool AreSame(std::span<const cv::Mat> left, std::span<const cv::Mat> right) {
  return std::equal(
      left.begin(), left.end(), right.begin(), right.end(), [](const cv::Mat& a, const cv::Mat& b) {
        bool same = !a.empty() && a.dims == 2 && b.dims == 2 && a.size() == b.size() && a.type() == b.type();
        for (int row = 0; same && row < a.rows; ++row) {
          same = std::memcmp(a.ptr(row), b.ptr(row), static_cast<std::size_t>(a.cols) * a.elemSize()) == 0;
        }
        return same;
      });
}

double MedianSigmaMm(const PointCloud& cloud) {
  HistogramMedian median(0, 1, 10000);
  const std::size_t step = cloud.size() / 100'000 + 1;  // plenty for a median
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    median.Add(static_cast<double>(cloud.sigma_mm[i]));
  }
  return median.total() > 0 ? median.Median() : 0;
}

Status JudgeConsistency(const ProjectorConsistency& figures, double sigma_px,
                        const ReconstructionConfig& config) {
  const double limit_px = std::hypot(config.max_column_rms_px, config.max_column_rms_sigma * sigma_px);
  if (!(figures.column_rms_px <= limit_px)) {
    return Fail(ErrorCode::kUntrusted,
                "no projector could have lit the points by the columns they show: {:.3f} px rms, limit "
                "{:.3f}: the cameras are exchanged or mirrored, or the calibration is of another rig",
                figures.column_rms_px, limit_px);
  }
  const double limit_parallax_px = config.max_parallax_ratio * figures.flat_column_rms_px;
  if (!(figures.flat_parallax_px <= limit_parallax_px)) {
    return Fail(
        ErrorCode::kUntrusted,
        "the fringes are those of a flat scene within {:.3f} px, the points are off a plane by {:.3f} "
        "px, limit {:.3f}: the cameras are exchanged or mirrored, or the calibration is of another "
        "rig",
        figures.flat_column_rms_px, figures.flat_parallax_px, limit_parallax_px);
  }
  return {};
}

}  // namespace

Reconstructor::Reconstructor(FringeDecoder decoder, StereoRig rig, const ReconstructionConfig& config)
    : decoder_(std::move(decoder)), rig_(std::move(rig)), config_(config) {}

Result<Reconstructor> Reconstructor::Create(const PatternSet& pattern, const StereoCalibration& calibration,
                                            ImageSize image_size, const ReconstructionConfig& config) {
  ASSIGN_OR_RETURN(auto decoder, FringeDecoder::Create(pattern, config));
  ASSIGN_OR_RETURN(auto rig, MakeStereoRig(calibration, image_size));
  return Reconstructor(std::move(decoder), std::move(rig), config);
}

Result<Reconstructor::Camera> Reconstructor::DecodeCamera(std::span<const cv::Mat> frames,
                                                          const char* name) const {
  auto view = decoder_.Decode(frames);
  if (!view.ok()) {
    return InCamera(name, view.error());
  }
  if (view->cause.cols != rig_.size().width_px || view->cause.rows != rig_.size().height_px) {
    return Fail(ErrorCode::kInvalidArgument, "{} camera: the frames have {} x {} px, prepared were {} x {}",
                name, view->cause.cols, view->cause.rows, rig_.size().width_px, rig_.size().height_px);
  }
  auto trust = MeasureTrust(frames, *view, decoder_, config_);
  if (!trust.ok()) {
    return InCamera(name, trust.error());
  }
  RETURN_IF_ERROR(JudgeTrust(*trust, decoder_, config_, name));
  const CameraQuality quality = {.pixels = view->count,
                                 .repaired = view->repaired,
                                 .clipping_dn = view->clipping_dn,
                                 .median_modulation_dn = view->median_modulation_dn,
                                 .median_sigma_px = view->median_sigma_px,
                                 .trust = *trust};
  return Camera{std::move(view).value(), quality};
}

Result<Reconstruction> Reconstructor::Run(std::span<const cv::Mat> left,
                                          std::span<const cv::Mat> right) const {
  if (AreSame(left, right)) {
    return Fail(ErrorCode::kInvalidArgument, "the left and the right frames are the same images");
  }
  ASSIGN_OR_RETURN(Camera left_camera, DecodeCamera(left, "left"));
  ASSIGN_OR_RETURN(Camera right_camera, DecodeCamera(right, "right"));
  auto computed = ComputeStereoPoints(left_camera.view, right_camera.view, rig_, config_);
  decoder_.Recycle(std::move(left_camera.view));
  decoder_.Recycle(std::move(right_camera.view));
  ASSIGN_OR_RETURN(StereoPoints points, std::move(computed));
  Reconstruction result;
  result.quality = {.left = left_camera.quality,
                    .right = right_camera.quality,
                    .stereo = points.count,
                    .median_projector_residual_px = points.median_projector_residual_px,
                    .projector_consistency = MeasureProjectorConsistency(points.sample, rig_.baseline_mm),
                    .median_sigma_mm = MedianSigmaMm(points.cloud_in_camera)};
  result.cloud_in_camera = std::move(points.cloud_in_camera);
  RETURN_IF_ERROR(Judge(result));
  return result;
}

Status Reconstructor::Judge(const Reconstruction& reconstruction) const {
  const ReconstructionQuality& quality = reconstruction.quality;
  const long points = quality.stereo.points;
  const auto& residual_px = quality.median_projector_residual_px;
  if (residual_px && std::abs(*residual_px) > config_.max_median_projector_residual_px) {
    return Fail(ErrorCode::kUntrusted,
                "the projector disagrees with the cameras by {:.2f} px (median), limit {:.2f}: the "
                "calibration drifted",
                *residual_px, config_.max_median_projector_residual_px);
  }
  if (static_cast<double>(points) <
      config_.min_matched_fraction * static_cast<double>(quality.stereo.candidates)) {
    return Fail(ErrorCode::kUntrusted,
                "only {} of {} decoded pixels became points, limit {:.0f} %: the cameras may be exchanged, "
                "or the calibration "
                "is of another rig",
                points, quality.stereo.candidates, 100 * config_.min_matched_fraction);
  }
  if (points < config_.min_points) {
    return Fail(ErrorCode::kUntrusted, "the view has {} points, at least {} are needed", points,
                config_.min_points);
  }
  return quality.projector_consistency
             ? JudgeConsistency(*quality.projector_consistency, quality.left.median_sigma_px, config_)
             : Status();
}

Result<Reconstruction> Reconstruct(std::span<const cv::Mat> left, std::span<const cv::Mat> right,
                                   const PatternSet& pattern, const StereoCalibration& calibration,
                                   const ReconstructionConfig& config) {
  RETURN_IF_ERROR(CheckFrames(left, pattern.frame_count()));
  const ImageSize image_size{left[0].cols, left[0].rows};
  ASSIGN_OR_RETURN(const auto reconstructor, Reconstructor::Create(pattern, calibration, image_size, config));
  return reconstructor.Run(left, right);
}

}  // namespace forgescan
