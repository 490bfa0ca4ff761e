// Second look at pixels whose fringe order was doubtful.
#pragma once

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

// A pixel masked by kUnwrapMargin moves by whole periods to where the median of its valid neighbours (5 x 5)
// is; it becomes valid if there are enough of them and it then comes near to it. Neighbours are taken as they
// were before any repair, so the order of visits does not matter. period_px: of the finest frequency. Returns
// the number of pixels made valid. See docs/design.md, "Fringe order" and "Masks and refusals".
long RepairFringeOrders(DecodedView& view, double period_px, const ReconstructionConfig& config);

// Masks by kBorder every valid pixel that has a masked one within config.mask_border_px (square window).
void DropMaskBorder(DecodedView& view, const ReconstructionConfig& config);

}  // namespace forgescan
