// The last step of the masks.
#pragma once

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/mask_map.h"
#include "services/reconstruction/reconstruction_config.h"

namespace forgescan {

// Masks by kBorder every valid pixel that has a masked one within config.mask_border_px (square window;
// nothing is masked beyond the image), and counts the pixels by cause. masked: of the view as it is; its
// counts are brought up to date.
void DropMaskBorder(const ReconstructionConfig& config, MaskMap& masked, DecodedView& view);

}  // namespace forgescan
