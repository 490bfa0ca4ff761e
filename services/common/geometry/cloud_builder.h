// Rows of a PLY or PCD file become points of a cloud.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "services/common/geometry/cloud_io.h"
#include "services/common/result.h"

namespace forgescan {

// What a cloud takes from a vertex, in this order.
enum CloudColumn { kX, kY, kZ, kNormalX, kNormalY, kNormalZ, kSigma, kView, kColumns };
inline constexpr std::array<std::pair<std::string_view, CloudColumn>, 11> kColumnNames = {
    {{"x", kX},
     {"y", kY},
     {"z", kZ},
     {"nx", kNormalX},
     {"ny", kNormalY},
     {"nz", kNormalZ},
     {"normal_x", kNormalX},
     {"normal_y", kNormalY},
     {"normal_z", kNormalZ},
     {"sigma_mm", kSigma},
     {"view", kView}}};

// The column that a property or field of this name fills, or -1.
inline int FindColumn(std::string_view property) {
  for (const auto& [name, column] : kColumnNames) {
    if (name == property) {
      return column;
    }
  }
  return -1;
}

// Up to here neighbouring single-precision numbers are less than 0.01 mm apart: 2^-7 mm.
inline constexpr double kMaxCoordinateMm = 1e5;

// Collects vertices row by row into a cloud; knows from the header which columns come.
class CloudBuilder {
 public:
  // False if another property already gives this column (nx and normal_x are one).
  bool Expect(int column) {
    if (column < 0) return true;
    return !std::exchange(has_[static_cast<std::size_t>(column)], true);
  }
  bool has_points() const { return has_[kX] && has_[kY] && has_[kZ]; }

  void Set(int column, double value) {
    if (column >= 0) {
      row_[static_cast<std::size_t>(column)] = value;
    }
  }
  // Errors: a number no cloud can hold.
  Status FinishRow(std::string_view name) {
    ++rows_;
    RETURN_IF_ERROR(CheckRow(name));
    if (!(std::isfinite(row_[kX]) && std::isfinite(row_[kY]) && std::isfinite(row_[kZ]))) {
      ++cloud_.not_finite;
      return {};
    }
    cloud_.points.push_back(At(kX));
    if (has_[kNormalX] && has_[kNormalY] && has_[kNormalZ]) {
      cloud_.normals.push_back(At(kNormalX));
    }
    if (has_[kSigma]) {
      cloud_.sigma_mm.push_back(static_cast<float>(row_[kSigma]));
    }
    if (has_[kView]) {
      cloud_.view.push_back(static_cast<std::uint16_t>(row_[kView]));
    }
    return {};
  }

  CloudFromFile Finish() && { return std::move(cloud_); }

 private:
  Status CheckRow(std::string_view name) const {
    constexpr double kMaxView = std::numeric_limits<std::uint16_t>::max();
    const double view = row_[kView];
    if (has_[kView] && !(view >= 0 && view <= kMaxView && view == std::floor(view))) {
      return Fail(ErrorCode::kFormat, "{}: the view index {} of point {} is not a whole number in 0..65535",
                  name, view, rows_);
    }
    for (const double value : row_) {
      if (std::isfinite(value) && std::abs(value) > std::numeric_limits<float>::max()) {
        return Fail(ErrorCode::kFormat, "{}: {} in point {} is too large for single precision", name, value,
                    rows_);
      }
    }
    for (const CloudColumn column : {kX, kY, kZ}) {
      if (std::isfinite(row_[column]) && std::abs(row_[column]) > kMaxCoordinateMm) {
        return Fail(
            ErrorCode::kFormat,
            "{}: the coordinate {} of point {} is beyond {} mm, where single precision does not resolve "
            "0.01 mm",
            name, row_[column], rows_, kMaxCoordinateMm);
      }
    }
    return {};
  }

  Eigen::Vector3f At(std::size_t first) const {
    return Eigen::Vector3d(row_[first], row_[first + 1], row_[first + 2]).cast<float>();
  }

  std::array<bool, kColumns> has_{};
  std::array<double, kColumns> row_{};
  CloudFromFile cloud_;
  std::size_t rows_ = 0;
};

}  // namespace forgescan
