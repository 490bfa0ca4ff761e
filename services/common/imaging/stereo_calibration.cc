#include "services/common/imaging/stereo_calibration.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <opencv2/core.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "services/common/input_file.h"

namespace forgescan {
namespace {

constexpr double kOrthonormalTolerance =
    1e-6;  // a rotation printed with 8 digits passes, one with 4 does not
constexpr double kMaxPixelAspect = 0.005;

// OpenCV's parsers call themselves for every level of nesting, and know no limit. Real files have three
// levels.
constexpr std::size_t kMaxFileBytes = 1'000'000;
constexpr std::size_t kLongestLine =
    10'000;  // "- - -" nests within a line, else every level indents its lines
constexpr int kDeepestBrackets = 100;
constexpr std::ptrdiff_t kMaxTags = 5000;  // of XML

bool NestsLittle(const std::string& text) {
  std::size_t line = 0;
  int depth = 0;
  for (const char c : text) {
    line = c == '\n' ? 0 : line + 1;
    depth += c == '[' || c == '{' ? 1 : 0;
    depth -= c == ']' || c == '}' ? 1 : 0;
    if (line > kLongestLine || depth > kDeepestBrackets) return false;
  }
  return text.size() <= kMaxFileBytes && std::count(text.begin(), text.end(), '<') <= kMaxTags;
}

// The lines that begin so, white space about them left out, which OpenCV skips.
std::vector<std::string_view> LinesWith(std::string_view text, std::string_view begin) {
  constexpr std::string_view kWhite = " \t\r\n";
  std::vector<std::string_view> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t word = std::min(text.find_first_not_of(kWhite, at), text.size());
    at = std::min(text.find('\n', word), text.size());
    const std::string_view line = text.substr(word, at - word);
    if (line.starts_with(begin)) lines.push_back(line.substr(0, line.find_last_not_of(kWhite) + 1));
  }
  return lines;
}

// OpenCV's YAML parser may run for ever on a file with several documents or directives, or with more on the
// line that begins the document; it writes one of each.
bool IsOneDocument(const std::string& text) {
  if (!text.starts_with("%YAML")) return true;  // XML or JSON
  const auto documents = LinesWith(text, "---");
  return LinesWith(text, "%").size() == 1 &&
         (documents.empty() || (documents.size() == 1 && documents[0] == "---"));
}

// OpenCV makes room for rows x cols numbers before it looks how many there are.
bool HasItsNumbers(const cv::FileNode& matrix) {
  const cv::FileNode rows = matrix["rows"], columns = matrix["cols"], data = matrix["data"];
  if (!rows.isInt() || !columns.isInt() || !data.isSeq()) {
    return false;
  }
  const auto row_count = static_cast<std::int64_t>(static_cast<int>(rows));
  const auto column_count = static_cast<std::int64_t>(static_cast<int>(columns));
  return row_count > 0 && column_count > 0 &&
         static_cast<std::uint64_t>(row_count * column_count) == data.size();
}

Result<std::vector<double>> ReadNumbers(const cv::FileStorage& file, const std::string& key,
                                        const std::string& name) {
  const cv::FileNode node = file[key];
  if (node.empty()) {
    return Fail(ErrorCode::kFormat, "{}: the entry {} is missing", name, key);
  }
  if (!node.isMap() || !HasItsNumbers(node)) {
    return Fail(ErrorCode::kFormat, "{}: the entry {} is not a matrix with rows times cols numbers", name,
                key);
  }
  const cv::Mat stored = node.mat();
  if (stored.empty() || stored.channels() != 1) {
    return Fail(ErrorCode::kFormat, "{}: the entry {} is not a matrix of numbers", name, key);
  }
  cv::Mat numbers;
  stored.convertTo(numbers, CV_64F);
  return std::vector<double>(numbers.begin<double>(), numbers.end<double>());
}

Result<Eigen::Matrix3d> ReadMatrix(const cv::FileStorage& file, const std::string& key,
                                   const std::string& name) {
  ASSIGN_OR_RETURN(const auto numbers, ReadNumbers(file, key, name));
  if (numbers.size() != 9) {
    return Fail(ErrorCode::kFormat, "{}: the entry {} has {} numbers instead of 3 x 3", name, key,
                numbers.size());
  }
  return Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data()));
}

Result<CameraIntrinsics> ReadIntrinsics(const cv::FileStorage& file, const std::string& suffix,
                                        const std::string& name) {
  CameraIntrinsics intrinsics;
  ASSIGN_OR_RETURN(intrinsics.camera_matrix, ReadMatrix(file, "K" + suffix, name));
  ASSIGN_OR_RETURN(intrinsics.distortion, ReadNumbers(file, "D" + suffix, name));
  constexpr std::array<std::size_t, 5> kModels = {4, 5, 8, 12, 14};  // OpenCV's lens models
  if (std::find(kModels.begin(), kModels.end(), intrinsics.distortion.size()) == kModels.end()) {
    return Fail(ErrorCode::kFormat, "{}: the entry D{} has {} numbers instead of 4, 5, 8, 12 or 14", name,
                suffix, intrinsics.distortion.size());
  }
  return intrinsics;
}

Result<PoseFromLeft> ReadPose(const cv::FileStorage& file, const std::string& suffix,
                              const std::string& name) {
  PoseFromLeft pose;
  ASSIGN_OR_RETURN(pose.rotation, ReadMatrix(file, "R" + suffix, name));
  ASSIGN_OR_RETURN(const auto translation, ReadNumbers(file, "T" + suffix, name));
  if (translation.size() != 3) {
    return Fail(ErrorCode::kFormat, "{}: the entry T{} has {} numbers instead of 3", name, suffix,
                translation.size());
  }
  pose.translation_mm = Eigen::Vector3d(translation[0], translation[1], translation[2]);
  return pose;
}

Result<std::optional<ImageSize>> ReadImageSize(const cv::FileStorage& file, const std::string& name) {
  const cv::FileNode width = file["image_width"];
  const cv::FileNode height = file["image_height"];
  if (width.empty() && height.empty()) {
    return std::optional<ImageSize>();
  }
  if (!width.isInt() || !height.isInt() || static_cast<int>(width) <= 0 || static_cast<int>(height) <= 0) {
    return Fail(ErrorCode::kFormat, "{}: image_width and image_height must both be positive whole numbers",
                name);
  }
  return std::optional(ImageSize{static_cast<int>(width), static_cast<int>(height)});
}

Result<StereoCalibration> ReadCalibration(const cv::FileStorage& file, const std::string& name) {
  StereoCalibration calibration;
  ASSIGN_OR_RETURN(calibration.left, ReadIntrinsics(file, "l", name));
  ASSIGN_OR_RETURN(calibration.right, ReadIntrinsics(file, "r", name));
  ASSIGN_OR_RETURN(calibration.right_from_left, ReadPose(file, "", name));
  ASSIGN_OR_RETURN(calibration.image_size, ReadImageSize(file, name));
  if (!file["Kp"].empty()) {
    ProjectorCalibration projector;
    ASSIGN_OR_RETURN(projector.intrinsics, ReadIntrinsics(file, "p", name));
    ASSIGN_OR_RETURN(projector.projector_from_left, ReadPose(file, "p", name));
    calibration.projector = std::move(projector);
  }
  return calibration;
}

// Everything but the focal lengths and the principal point is given: OpenCV's model knows no skew.
Status CheckForm(const Eigen::Matrix3d& camera_matrix, const char* which) {
  Eigen::Matrix3d form = Eigen::Matrix3d::Identity();
  for (const auto& [row, column] : {std::pair(0, 0), std::pair(1, 1), std::pair(0, 2), std::pair(1, 2)}) {
    form(row, column) = camera_matrix(row, column);
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (camera_matrix(row, column) != form(row, column)) {
        return Fail(ErrorCode::kInvalidArgument,
                    "the camera matrix of the {} holds {} in row {}, column {}, where only {} is allowed",
                    which, camera_matrix(row, column), row + 1, column + 1, form(row, column));
      }
    }
  }
  return {};
}

Status CheckIntrinsics(const CameraIntrinsics& camera, const char* which) {
  const bool finite =
      camera.camera_matrix.allFinite() && std::all_of(camera.distortion.begin(), camera.distortion.end(),
                                                      [](double value) { return std::isfinite(value); });
  if (!finite) {
    return Fail(ErrorCode::kInvalidArgument, "the intrinsics of the {} hold a number that is not finite",
                which);
  }
  if (!(camera.camera_matrix(0, 0) > 0) || !(camera.camera_matrix(1, 1) > 0)) {
    return Fail(ErrorCode::kInvalidArgument,
                "the focal lengths of the {} are {} and {} px, they must be positive", which,
                camera.camera_matrix(0, 0), camera.camera_matrix(1, 1));
  }
  return CheckForm(camera.camera_matrix, which);
}

// Industrial cameras have square pixels; a focal length that was mistyped has not.
Status CheckPixels(const CameraIntrinsics& camera, const char* which) {
  const double ratio = camera.camera_matrix(0, 0) / camera.camera_matrix(1, 1);
  if (std::abs(ratio - 1) > kMaxPixelAspect) {
    return Fail(ErrorCode::kInvalidArgument,
                "the focal lengths of the {} are {:.1f} and {:.1f} px, square pixels need them equal to {} %",
                which, camera.camera_matrix(0, 0), camera.camera_matrix(1, 1), 100 * kMaxPixelAspect);
  }
  return {};
}

Status CheckPose(const PoseFromLeft& pose, const char* which) {
  if (!pose.rotation.allFinite() || !pose.translation_mm.allFinite()) {
    return Fail(ErrorCode::kInvalidArgument, "the pose of the {} holds a number that is not finite", which);
  }
  const double error =
      (pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kOrthonormalTolerance || pose.rotation.determinant() < 0) {
    return Fail(ErrorCode::kInvalidArgument,
                "the rotation of the {} is not a rotation: R R' is off by {:.2g}, limit {:.0g}", which, error,
                kOrthonormalTolerance);
  }
  if (!(pose.translation_mm.norm() > 0)) {
    return Fail(ErrorCode::kInvalidArgument, "the baseline of the {} is 0 mm", which);
  }
  return {};
}

}  // namespace

Status Check(const StereoCalibration& calibration) {
  RETURN_IF_ERROR(CheckIntrinsics(calibration.left, "left camera"));
  RETURN_IF_ERROR(CheckIntrinsics(calibration.right, "right camera"));
  RETURN_IF_ERROR(CheckPixels(calibration.left, "left camera"));
  RETURN_IF_ERROR(CheckPixels(calibration.right, "right camera"));
  RETURN_IF_ERROR(CheckPose(calibration.right_from_left, "right camera"));
  if (calibration.projector) {
    RETURN_IF_ERROR(CheckIntrinsics(calibration.projector->intrinsics, "projector"));
    RETURN_IF_ERROR(CheckPose(calibration.projector->projector_from_left, "projector"));
  }
  return {};
}

Result<StereoCalibration> LoadStereoCalibration(const std::filesystem::path& path) {
  const std::string name = path.string();
  if (!std::filesystem::is_regular_file(path)) {
    return Fail(ErrorCode::kNotFound, "{}: there is no such calibration file", name);
  }
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(path));
  if (!NestsLittle(text)) {
    return Fail(ErrorCode::kFormat, "{}: is not a calibration file: larger than 1 MB, or nested deeply",
                name);
  }
  if (!IsOneDocument(text)) {
    return Fail(ErrorCode::kFormat,
                "{}: is not a calibration file: one line %YAML and one line --- are allowed", name);
  }
  try {
    const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!file.isOpened()) {
      return Fail(ErrorCode::kFormat, "{}: is not an OpenCV calibration file", name);
    }
    ASSIGN_OR_RETURN(auto calibration, ReadCalibration(file, name));
    if (const Status status = Check(calibration); !status.ok()) {
      return Fail(status.error().code, "{}: {}", name, status.error().message);
    }
    return calibration;
  } catch (const std::exception&) {  // cv::Exception, and what its parsers do not catch themselves
    return Fail(ErrorCode::kFormat, "{}: is not a well-formed OpenCV calibration file", name);
  }
}

}  // namespace forgescan
