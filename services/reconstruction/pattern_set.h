// What the projector showed, frame by frame.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

// kOwn: each frequency has the frames to solve for its own background. kShared: one background for all
// frequencies (paper, 2.2.1: 3-2-2 frames instead of 4-4-4), which only a linear projector allows.
enum class Background { kOwn, kShared };

// The plain frame. kWhite: full light, A + B / m; it checks light and contrast, and finds a large drift.
// kMidGrey: the fringes' mean light, A; with a shared background it measures the drift of every pixel, and
// the background is interpolated in time.
enum class ReferenceLight { kWhite, kMidGrey };

// Frames I = A + B cos(2 pi (x - origin) / period + shift), x the projector column.
struct FringeFrequency {
  double period_px = 0;           // projector px, need not divide the width
  std::vector<int> frame_index;   // which of the view's frames
  std::vector<double> shift_rad;  // one per frame
  double modulation_ratio = 1.0;  // expected B of this frequency over B of the first one
};

struct PatternSet {
  int projector_width_px = 0;
  double phase_origin_px = 0;  // projector column where the phase is 0; the centre of the first column is 0
  Background background = Background::kOwn;
  std::vector<FringeFrequency> frequencies;  // 2 or 3
  std::vector<std::string> frame_names;      // in order of frame_index; file names offline
  std::optional<int> reference_frame_index;  // a frame with plain light; project it last
  ReferenceLight reference_light = ReferenceLight::kWhite;
  double reference_contrast = 1.0;  // m: white = A + B / m

  int frame_count() const { return static_cast<int>(frame_names.size()); }
  // B's share of what the reference shows beside A.
  double ReferencePerModulation() const {
    return reference_light == ReferenceLight::kWhite ? 1 / reference_contrast : 0;
  }
};

// Errors: kInvalidArgument with the entry that is wrong and its allowed range.
Status Check(const PatternSet& pattern);

// Reads pattern.toml: projector_width_px, background = "own" | "shared", optional phase_origin_px, reference,
// reference_light = "white" | "mid_grey" and reference_contrast, and [[frequency]] with period_px, frames,
// shifts_deg and optional modulation_ratio. Frame indices follow the order of listing; the reference comes
// last. Errors: kNotFound, kFormat (key), and those of Check().
Result<PatternSet> LoadPatternSet(const std::filesystem::path& path);
Result<PatternSet> ParsePatternSet(std::string_view toml_text, const std::string& name);

}  // namespace forgescan
