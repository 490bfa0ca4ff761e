#include "tools/forgescan/frame_file.h"

#include <unistd.h>

#include <cstdio>
#include <exception>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "services/common/input_file.h"
#include "tools/forgescan/image_header.h"

namespace forgescan {
namespace {

constexpr std::uint64_t kMaxPixels = 200'000'000;  // more than any camera; codecs make room before they look

// Image codecs write their complaints on stderr themselves. While this lives they land here instead, so that
// the user gets one sentence, and a complaint about a picture that was decoded all the same (a cut off JPEG)
// is not lost.
class CodecComplaints {
 public:
  CodecComplaints() : file_(std::tmpfile()), stderr_(dup(STDERR_FILENO)) {
    if (file_ != nullptr) {
      dup2(fileno(file_), STDERR_FILENO);
    }
  }
  CodecComplaints(const CodecComplaints&) = delete;
  CodecComplaints& operator=(const CodecComplaints&) = delete;
  ~CodecComplaints() {
    dup2(stderr_, STDERR_FILENO);
    close(stderr_);
    if (file_ != nullptr) {
      std::fclose(file_);
    }
  }
  bool any() const { return file_ != nullptr && lseek(fileno(file_), 0, SEEK_END) > 0; }

 private:
  std::FILE* file_;
  int stderr_;
};

}  // namespace

Result<cv::Mat> ReadFrame(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    return Fail(ErrorCode::kNotFound, "{}: there is no such frame", path.string());
  }
  ASSIGN_OR_RETURN(const std::string bytes, ReadInputFile(path));
  if (const auto pixels = ClaimedPixels(bytes); pixels.value_or(0) > kMaxPixels) {
    return Fail(ErrorCode::kFormat, "{}: claims {} pixels, allowed up to {}", path.string(), *pixels,
                kMaxPixels);
  }
  const CodecComplaints complaints;
  cv::Mat frame;
  try {
    frame = cv::imread(path.string(), cv::IMREAD_UNCHANGED);
  } catch (const std::exception&) {  // sizes that no image has
    return Fail(ErrorCode::kFormat, "{}: is not a readable image", path.string());
  }
  if (frame.empty() || complaints.any()) {
    return Fail(ErrorCode::kFormat, "{}: is not a readable image, or is cut off", path.string());
  }
  if (frame.type() != CV_8UC1 && frame.type() != CV_16UC1) {
    return Fail(ErrorCode::kFormat, "{}: is not a grey image of 8 or 16 bit", path.string());
  }
  return frame;
}

}  // namespace forgescan
