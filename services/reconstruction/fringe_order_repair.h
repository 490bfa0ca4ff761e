// Second look at pixels whose fringe order was doubtful.
#pragma once

#include <cstdint>
#include <vector>

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/mask_map.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

// A pixel masked by kUnwrapMargin moves by whole periods to where the median of its valid neighbours (5 x 5)
// is; it becomes valid if there are enough of them and it then comes near to it. Neighbours are taken as they
// were before any repair, so the order of visits does not matter. Its variance, predicted for another order,
// becomes the largest of theirs, as far as variances are kept. A pixel that stays masked loses its
// coordinate. doubtful_rows: whether a row has such pixels. period_px: of the finest frequency. masked: of
// the view, is brought up to date. Returns the number of pixels made valid. See docs/design.md, "Fringe
// order" and "Masks and refusals".
long RepairFringeOrders(const std::vector<std::uint8_t>& doubtful_rows, double period_px,
                        const ReconstructionConfig& config, MaskMap& masked, DecodedView& view);

}  // namespace forgescan
