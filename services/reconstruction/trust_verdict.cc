#include "services/reconstruction/trust.h"

namespace forgescan {

Status JudgeTrust(const TrustFigures& figures, const FringeDecoder& decoder,
                  const ReconstructionConfig& config, const char* camera) {
  const bool shared = decoder.pattern().background == Background::kShared;
  if (figures.saturated_fraction > config.max_saturated_fraction) {
    return Fail(ErrorCode::kUntrusted,
                "{:.0f} % of the lit pixels of the {} camera are saturated, limit {:.0f} %: expose less",
                100 * figures.saturated_fraction, camera, 100 * config.max_saturated_fraction);
  }
  if (figures.disagreement_rad > config.max_disagreement_rad) {
    return Fail(ErrorCode::kUntrusted,
                "the frequencies disagree by {:.3f} rad rms in the {} camera, limit {:.3f}: {}",
                figures.disagreement_rad, camera, config.max_disagreement_rad,
                shared ? "this projector is not linear enough for a shared background, or a frame is not "
                         "what the pattern set says"
                       : "a frame is not what the pattern set says, or the scene moved");
  }
  const double uncut = figures.uncut_reference_fraction.value_or(1);
  if (shared && uncut < config.min_uncut_reference_fraction) {
    return Fail(ErrorCode::kUntrusted,
                "the reference frame of the {} camera is cut off, saturated or black, in {:.0f} % of the lit "
                "pixels, at most {:.0f} % may be: whether the shared background drifts cannot be told",
                camera, 100 * (1 - uncut), 100 * (1 - config.min_uncut_reference_fraction));
  }
  if (shared && figures.drift_phase_rad && *figures.drift_phase_rad > config.max_drift_phase_rad) {
    return Fail(ErrorCode::kUntrusted,
                "the background of the {} camera drifts by {:.2f} grey values a frame, which bends the "
                "phases by up to {:.3f} "
                "rad, limit {:.3f}: too much for a shared background",
                camera, *figures.drift_dn, *figures.drift_phase_rad, config.max_drift_phase_rad);
  }
  const auto harmonic =
      figures.second_harmonic_ratio ? figures.second_harmonic_ratio : figures.suspected_second_harmonic;
  if (shared && harmonic && *harmonic > config.max_shared_second_harmonic) {
    return Fail(ErrorCode::kUntrusted,
                "the projector's 2nd harmonic is about {:.3f} of the 1st in the {} camera, limit {:.3f}: "
                "this projector is not "
                "linear enough for a shared background",
                *harmonic, camera, config.max_shared_second_harmonic);
  }
  return {};
}

}  // namespace forgescan
