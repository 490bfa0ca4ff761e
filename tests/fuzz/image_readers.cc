// Images of a camera as files.
#include <array>
#include <opencv2/imgcodecs.hpp>

#include "tests/fuzz/readers.h"
#include "tools/forgescan/frame_file.h"

namespace forgescan::fuzz {
namespace {

std::string Encoded(const char* ending, int type) {
  cv::Mat image(24, 32, type);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const int value = row * 7 + column * 5;
      type == CV_8UC1 ? image.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(value)
                      : image.at<std::uint16_t>(row, column) = static_cast<std::uint16_t>(16 * value);
    }
  }
  std::vector<unsigned char> bytes;
  cv::imencode(ending, image, bytes);
  return {bytes.begin(), bytes.end()};
}

Outcome ReadImage(const std::string& bytes) {
  return Judge(ReadFrame(ScratchFile("0.png", bytes)), "0.png", [](const cv::Mat& frame) {
    const bool grey = frame.type() == CV_8UC1 || frame.type() == CV_16UC1;
    return grey && !frame.empty() ? "" : "an image that is none";
  });
}

}  // namespace

std::vector<Reader> Readers() {
  std::vector<std::string> seeds;
  for (const char* ending : {".png", ".pgm", ".tiff"}) {
    for (const int type : {CV_8UC1, CV_16UC1}) seeds.push_back(Encoded(ending, type));
  }
  seeds.push_back(Encoded(".bmp", CV_8UC1));
  return {{"image", 10'000, seeds, ReadImage}};
}

}  // namespace forgescan::fuzz
