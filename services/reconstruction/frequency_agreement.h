// By how much the phases of one pixel's frequencies contradict each other, and what would make them.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <vector>

#include "services/reconstruction/fringe_decoder.h"

namespace forgescan {

// Phasors: B exp(i phi) of the frequencies, DN.

// Grey values that a 2nd harmonic of size 1 times B adds to the frames: column 0 in phase, column 1 in
// quadrature.
Eigen::MatrixX2d HarmonicFrames(const PatternSet& pattern, const std::vector<std::complex<double>>& phasors);

// Mean square, turn^2 or rad^2, of what the others differ by from the finest frequency, which has these
// errors.
double SquaredDisagreement(const FringeOrderTable& table, const Eigen::VectorXd& errors);

// Rms difference of the other frequencies from the finest one, rad. Its fringe order is that of the
// coordinate, or, where that is NaN, of the table.
double DisagreementRad(const FringeDecoder& decoder, const std::vector<std::complex<double>>& phasors,
                       double coordinate_px);

// Rms disagreement per unit of 2nd harmonic ratio, averaged over all phases; 0 where the frames cancel it.
double HarmonicGain(const FringeDecoder& decoder);

}  // namespace forgescan
