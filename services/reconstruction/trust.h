// Whether one camera's frames fit the model they were decoded with.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>

#include "services/common/result.h"
#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/fringe_decoder.h"

namespace forgescan {

struct TrustFigures {
  double disagreement_rad = 0;            // of the frequencies, robust rms over the lit pixels
  double predicted_disagreement_rad = 0;  // what the noise model alone would give
  double saturated_fraction = 0;          // of the lit pixels
  std::optional<double> noise_dn;  // rms of a grey value about model and harmonic; needs redundant frames
  std::optional<double> second_harmonic_ratio;     // 2nd over 1st harmonic, measured; needs redundant frames
  std::optional<double> uncut_reference_fraction;  // of the lit pixels; needs a reference frame
  std::optional<double> drift_dn;  // of the background a frame, median; needs a reference frame that is not
                                   // cut off, saturated or black, in some of them
  std::optional<double> drift_phase_rad;            // the largest phase error this drift causes
  std::optional<double> suspected_second_harmonic;  // the 2nd harmonic that would explain the disagreement
};

// From about 20,000 pixels on a regular grid. The 2nd harmonic is the least-squares fit of B cos(2 phi +
// psi), one ratio and one psi for the view, to what the phase model leaves of the frames; for 4 own frames I1
// + I3 - I2 - I4 = 4 B2 cos(2 phi). See docs/design.md, "Masks and refusals". Errors: kDegenerate when no
// pixel is lit.
Result<TrustFigures> MeasureTrust(std::span<const cv::Mat> frames, const DecodedView& view,
                                  const FringeDecoder& decoder, const ReconstructionConfig& config);

// The verdict on the figures. camera: "left", "right", for the sentence. Errors: kUntrusted.
Status JudgeTrust(const TrustFigures& figures, const FringeDecoder& decoder,
                  const ReconstructionConfig& config, const char* camera);

}  // namespace forgescan
