#include "services/reconstruction/reconstruct.h"

#include <cmath>
#include <utility>

#include "services/reconstruction/disparity.h"
#include "services/reconstruction/histogram_median.h"
#include "services/reconstruction/rectify_coordinates.h"
#include "services/reconstruction/triangulate.h"

namespace forgescan {
namespace {

Error InCamera(const char* name, const Error& error) {
  return Error{error.code, fmt::format("{} camera: {}", name, error.message), error.where};
}

double MedianSigmaMm(const PointCloud& cloud) {
  HistogramMedian median(0, 1, 10000);
  for (const float sigma_mm : cloud.sigma_mm) {
    median.Add(static_cast<double>(sigma_mm));
  }
  return median.total() > 0 ? median.Median() : 0;
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
                                 .median_modulation_dn = view->median_modulation_dn,
                                 .median_noise_to_modulation = view->median_noise_to_modulation,
                                 .trust = *trust};
  return Camera{std::move(view).value(), quality};
}

Result<Reconstruction> Reconstructor::Run(std::span<const cv::Mat> left,
                                          std::span<const cv::Mat> right) const {
  ASSIGN_OR_RETURN(const Camera left_camera, DecodeCamera(left, "left"));
  ASSIGN_OR_RETURN(const Camera right_camera, DecodeCamera(right, "right"));
  const RectifiedView left_view = RectifyCoordinates(left_camera.view, rig_.left_map, config_);
  const RectifiedView right_view = RectifyCoordinates(right_camera.view, rig_.right_map, config_);
  ASSIGN_OR_RETURN(const DisparityMap map, MatchViews(left_view, right_view, rig_, config_));
  Triangulation points = Triangulate(map, left_view, rig_, config_);
  Reconstruction result;
  result.quality = {.left = left_camera.quality,
                    .right = right_camera.quality,
                    .candidates = map.candidates,
                    .no_partner = map.no_partner,
                    .ambiguous = map.ambiguous,
                    .left_right = map.left_right,
                    .depth_range = points.depth_range,
                    .no_normal = points.no_normal,
                    .steep = points.steep,
                    .projector = points.projector,
                    .median_projector_residual_px = points.median_projector_residual_px,
                    .median_sigma_mm = MedianSigmaMm(points.cloud_in_camera)};
  result.cloud_in_camera = std::move(points.cloud_in_camera);
  RETURN_IF_ERROR(Judge(result));
  return result;
}

Status Reconstructor::Judge(const Reconstruction& reconstruction) const {
  const ReconstructionQuality& quality = reconstruction.quality;
  const auto points = static_cast<long>(reconstruction.cloud_in_camera.size());
  const auto& residual_px = quality.median_projector_residual_px;
  if (residual_px && std::abs(*residual_px) > config_.max_median_projector_residual_px) {
    return Fail(ErrorCode::kUntrusted,
                "the projector disagrees with the cameras by {:.2f} px (median), limit {:.2f}: the "
                "calibration drifted",
                *residual_px, config_.max_median_projector_residual_px);
  }
  if (static_cast<double>(points) < config_.min_matched_fraction * static_cast<double>(quality.candidates)) {
    return Fail(ErrorCode::kUntrusted,
                "only {} of {} decoded pixels became points, limit {:.0f} %: the cameras may be exchanged, "
                "or the calibration "
                "is of another rig",
                points, quality.candidates, 100 * config_.min_matched_fraction);
  }
  if (points < config_.min_points) {
    return Fail(ErrorCode::kUntrusted, "the view has {} points, at least {} are needed", points,
                config_.min_points);
  }
  return {};
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
