// Frames of both cameras -> the points of one view, with a statement of how far to trust them.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>

#include "services/common/geometry/point_cloud.h"
#include "services/common/imaging/stereo_calibration.h"
#include "services/common/result.h"
#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/fringe_decoder.h"
#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/projector_consistency.h"
#include "services/reconstruction/reconstruction_config.h"
#include "services/reconstruction/stereo_points.h"
#include "services/reconstruction/stereo_rig.h"
#include "services/reconstruction/trust.h"

namespace forgescan {

struct CameraQuality {
  std::array<long, kMaskCauses> pixels{};  // by MaskCause
  long repaired = 0;
  std::optional<double> clipping_dn;  // see DecodedView
  double median_modulation_dn = 0;
  double median_sigma_px = 0;
  TrustFigures trust;
};

struct ReconstructionQuality {
  CameraQuality left;
  CameraQuality right;
  StereoCounts stereo;
  std::optional<double> median_projector_residual_px;
  std::optional<ProjectorConsistency> projector_consistency;  // nothing with too few points
  double median_sigma_mm = 0;
};

struct Reconstruction {
  PointCloud cloud_in_camera;  // rectified left camera (see StereoRig), scanner order, thinned as configured;
                               // points, normals, sigma_mm
  ReconstructionQuality quality;
};

// Prepared for one pattern set, calibration and image size; then used for every view, from any thread.
class Reconstructor {
 public:
  // Errors: those of FringeDecoder::Create and MakeStereoRig. Cost: about 0.2 s at 5 MP.
  static Result<Reconstructor> Create(const PatternSet& pattern, const StereoCalibration& calibration,
                                      ImageSize image_size, const ReconstructionConfig& config);

  // Shape: see FringeDecoder::Decode. Errors: kInvalidArgument (frames), kDegenerate (nothing to see),
  // kUntrusted (a result exists, and one of its checks says not to use it).
  Result<Reconstruction> Run(std::span<const cv::Mat> left, std::span<const cv::Mat> right) const;

  const StereoRig& rig() const { return rig_; }
  const FringeDecoder& decoder() const { return decoder_; }

 private:
  struct Camera {
    DecodedView view;
    CameraQuality quality;
  };
  Reconstructor(FringeDecoder decoder, StereoRig rig, const ReconstructionConfig& config);
  Result<Camera> DecodeCamera(std::span<const cv::Mat> frames, const char* name) const;
  Status Judge(const Reconstruction& reconstruction) const;

  FringeDecoder decoder_;
  StereoRig rig_;
  ReconstructionConfig config_;
};

// All at once, for a single view.
Result<Reconstruction> Reconstruct(std::span<const cv::Mat> left, std::span<const cv::Mat> right,
                                   const PatternSet& pattern, const StereoCalibration& calibration,
                                   const ReconstructionConfig& config);

}  // namespace forgescan
