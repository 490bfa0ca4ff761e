// The last step of the masks.
#pragma once

#include "services/reconstruction/decoded_view.h"
#include "services/reconstruction/reconstruction_config.h"
#include "services/common/simd_path.h"

namespace forgescan {

// Masks by kBorder every valid pixel that has a masked one within config.mask_border_px (square window;
// nothing is masked beyond the image), and counts the pixels by cause.
void DropMaskBorder(const ReconstructionConfig& config, SimdPath path, DecodedView& view);

}  // namespace forgescan
