#include "services/common/model/stl_file.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <numeric>
#include <string_view>
#include <tuple>
#include <vector>

namespace forgescan {
namespace {

constexpr std::size_t kBinaryHeader = 84;  // 80 bytes of comment and the u32 count
constexpr std::size_t kBinaryTriangle = 50;
constexpr float kMaxCoordinateMm = 1e5F;  // as in a cloud: beyond, single precision does not resolve 0.01 mm

using Corners = std::vector<Eigen::Vector3f>;  // three per triangle

Result<TriangleMesh> Weld(const Corners& corners) {
  if (corners.empty()) return Fail(ErrorCode::kFormat, "the STL file has no triangles");
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!corners[i].allFinite()) return Fail(ErrorCode::kFormat, "STL triangle {} is not finite", i / 3);
    if (const float largest = corners[i].cwiseAbs().maxCoeff(); largest > kMaxCoordinateMm) {
      return Fail(ErrorCode::kFormat, "STL triangle {} has the coordinate {}, allowed up to {} mm", i / 3,
                  largest, kMaxCoordinateMm);
    }
  }
  std::vector<std::uint32_t> order(corners.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) {
    return std::tuple(corners[i].x(), corners[i].y(), corners[i].z());
  };
  std::sort(order.begin(), order.end(),
            [&](auto i, auto j) { return key(i) < key(j) || (key(i) == key(j) && i < j); });
  TriangleMesh mesh;
  mesh.triangles.resize(corners.size() / 3);
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k == 0 || key(order[k]) != key(order[k - 1])) mesh.vertices.push_back(corners[order[k]]);
    mesh.triangles[order[k] / 3][order[k] % 3] = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  }
  return mesh;
}

Corners BinaryCorners(const std::string& bytes, std::size_t count) {
  Corners corners(3 * count);
  for (std::size_t i = 0; i < count; ++i) {
    // 12 bytes of normal come first, 2 of attributes last.
    std::memcpy(corners[3 * i].data(), bytes.data() + kBinaryHeader + i * kBinaryTriangle + 12, 36);
  }
  return corners;
}

class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  std::string_view Next() {
    constexpr std::string_view kSpace = " \t\r\n\f\v";
    const std::size_t begin = text_.find_first_not_of(kSpace);
    if (begin == std::string_view::npos) return {};
    const std::size_t end = std::min(text_.find_first_of(kSpace, begin), text_.size());
    const std::string_view word = text_.substr(begin, end - begin);
    text_.remove_prefix(end);
    return word;
  }
  bool NextFloat(float& value) {
    std::string_view word = Next();
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
  }

 private:
  std::string_view text_;
};

// Every "vertex x y z" in order; the words between are only checked for "vertex" coming in threes.
Result<Corners> AsciiCorners(const std::string& bytes) {
  Corners corners;
  Words words(bytes);
  bool ended = false;
  for (std::string_view word = words.Next(); !word.empty(); word = words.Next()) {
    if (word == "endfacet" && corners.size() % 3 != 0) {
      return Fail(ErrorCode::kFormat, "STL triangle {} does not have three corners", corners.size() / 3);
    }
    ended = ended || word == "endsolid";
    if (word != "vertex") continue;
    Eigen::Vector3f v;
    if (!words.NextFloat(v.x()) || !words.NextFloat(v.y()) || !words.NextFloat(v.z())) {
      return Fail(ErrorCode::kFormat, "STL triangle {} has a corner that is not three numbers",
                  corners.size() / 3);
    }
    corners.push_back(v);
  }
  if (!ended || corners.size() % 3 != 0) {
    return Fail(ErrorCode::kFormat, "the STL text ends after triangle {} without endsolid",
                corners.size() / 3);
  }
  return corners;
}

}  // namespace

Result<TriangleMesh> DecodeStl(const std::string& bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kBinaryHeader) std::memcpy(&count, bytes.data() + 80, 4);
  // The length decides, because writers of binary files also begin their comment with "solid".
  if (bytes.size() >= kBinaryHeader && bytes.size() == kBinaryHeader + std::size_t{count} * kBinaryTriangle) {
    return Weld(BinaryCorners(bytes, count));
  }
  if (bytes.starts_with("solid")) {
    ASSIGN_OR_RETURN(const Corners corners, AsciiCorners(bytes));
    return Weld(corners);
  }
  return Fail(ErrorCode::kFormat,
              "neither an ascii STL (no 'solid') nor a binary one ({} bytes do not hold {} triangles)",
              bytes.size(), count);
}

}  // namespace forgescan
