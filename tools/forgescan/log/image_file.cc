#include "tools/forgescan/log/image_file.h"

#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "fsmsg/exposure_t.hpp"

namespace forgescan {

Result<std::string> EncodePng(const fsmsg::frame_t& frame) {
  constexpr int kFast = 1;  // of 9: a session has hundreds of images, and noise does not compress
  try {
    const cv::Mat image(frame.height_px, frame.width_px, CV_8UC1,
                        const_cast<std::uint8_t*>(frame.data.data()));
    std::vector<std::uint8_t> bytes;
    if (cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, kFast})) {
      return std::string(bytes.begin(), bytes.end());
    }
  } catch (const std::exception&) {  // OpenCV's: told apart from false by nothing that matters here
  }
  return Fail(ErrorCode::kInvalidArgument, "an image of {} x {} px cannot be written as PNG", frame.width_px,
              frame.height_px);
}

std::string CameraName(int camera) {
  return camera == fsmsg::exposure_t::CAMERA_LEFT    ? "left"
         : camera == fsmsg::exposure_t::CAMERA_RIGHT ? "right"
                                                     : "unknown";
}

}  // namespace forgescan
