// The virtual cell without a part, through the computations of a real station: what stands still in it. Needs
// the station's files as the services read them; nothing of the cell's truth gets into the result.
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "services/fusion/standing_surfaces.h"
#include "services/reconstruction/reconstruct.h"
#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {

// The visit of the empty cell's scan: another one than any inspection's.
inline constexpr int kVisitWithoutPart = 1'000'000;

// Both cameras' images of a view by the reduced set, left first.
using StereoImages = std::array<std::vector<cv::Mat>, 2>;
Result<StereoImages> TakeImages(const VirtualCell& cell, const PartState& part, const ViewState& view);

// Images of both cameras, reconstruction. The view's temperature is what the pyrometer says. Errors: those of
// the cell and of the reconstruction, naming visit and view.
Result<ViewCloud> ScanView(const VirtualCell& cell, const Reconstructor& reconstructor, const PartState& part,
                           const ViewState& view);

// The views of the cell while the part is elsewhere; one that shows too little to be trusted is left out.
Result<std::vector<ViewCloud>> ScanEmptyCell(const VirtualCell& cell, const Reconstructor& reconstructor,
                                             PartState part, const std::vector<ViewState>& views);

// Where the posts stand, as a fitter measures it: array frame, 20 mm more on each side.
std::vector<Eigen::AlignedBox3d> PostRegions(const std::vector<PostConfig>& posts);

// Makes the file of standing surfaces that the prepared station in `folder` names, from one scan of the empty
// cell with errors of the robot and noise of its own; nothing if it names none. Its other files must be
// there. Cost: about 10 s for ten views of 5 MP on two threads.
Status WriteStandingOf(const CellConfig& config, const std::string& folder, int threads);

}  // namespace forgescan
