// One image of a camera as a file.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "services/common/result.h"

namespace forgescan {

// Any format of OpenCV's codecs. Shape: CV_8UC1 or CV_16UC1. Errors: kNotFound; kFormat (no image, cut off,
// more than 200 million pixels, or not grey of 8 or 16 bit). While it runs, standard error is kept from the
// codecs.
Result<cv::Mat> ReadFrame(const std::filesystem::path& path);

}  // namespace forgescan
