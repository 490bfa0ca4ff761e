// The arithmetic of FringeDecoder on a short piece of an image row: arrays in, arrays out, loops that
// vectorise.
#pragma once

#include <array>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "services/reconstruction/fringe_order_table.h"
#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/phase_estimator.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

// One per thread. Load() a strip, Decode() it, then read the results.
class StripDecoder {
 public:
  static constexpr int kLength = 512;  // px; all arrays of a strip stay in the second-level cache
  static constexpr int kMaxFrequencies = 3;
  using Lane = std::array<float, kLength>;

  StripDecoder(const PatternSet& pattern, const ReconstructionConfig& config, const PhaseEstimator& estimator,
               const FringeOrderTable& table);

  // Pixels [column, column + length) of a row; length <= kLength.
  void Load(std::span<const cv::Mat> frames, int row, int column, int length);
  void Decode();

  Lane coordinate_px;
  Lane sigma_px;
  Lane modulation_dn;    // least of the frequencies
  Lane phase_sigma_rad;  // predicted; worst of the frequencies, average over the phase
  Lane disagreement_rad;
  std::array<std::int32_t, kLength> cause;

 private:
  struct Weighted {
    std::size_t frame;
    float cosine;
    float sine;
    float background;
  };
  struct FrameTerm {  // how a frame's noise reaches the fused coordinate, by one frequency
    std::size_t frequency;
    float cosine;
    float sine;
  };

  void SolvePhases(std::size_t j);
  void Unwrap();
  void Fuse();
  void PredictSigma();
  void Classify();
  void ClassifyRatios();
  void ClassifyReference();

  const PatternSet& pattern_;
  const FringeOrderTable& table_;
  ReconstructionConfig config_;
  std::vector<std::vector<Weighted>> weights_;  // by frequency
  std::vector<std::vector<FrameTerm>> terms_;   // by frame
  std::array<float, kMaxFrequencies> period_px_{};
  std::array<float, kMaxFrequencies> fusion_{};
  std::array<float, kMaxFrequencies> phase_noise_{};  // phase sigma over sigma / B
  float reference_noise_ = 0;                         // sigma of A + B / contrast over that of a grey value
  bool models_drift_ = false;                         // the reference is part of the model, not a check of it
  int length_ = 0;

  std::vector<Lane> frames_;  // grey values, 8-bit DN
  Lane peak_;
  std::array<Lane, kMaxFrequencies> background_;
  std::array<Lane, kMaxFrequencies> modulation_;
  std::array<Lane, kMaxFrequencies> cosine_;  // of the phase
  std::array<Lane, kMaxFrequencies> sine_;
  std::array<Lane, kMaxFrequencies> turns_;  // the phase
  std::array<float, kLength> order_;
  std::array<std::int32_t, kLength> doubtful_;
  Lane grey_sigma_;
};

}  // namespace forgescan
