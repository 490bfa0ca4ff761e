#include "services/reconstruction/epipolar_table.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <span>

#include "services/common/huge_pages.h"

namespace forgescan {
namespace {

constexpr int kHalfBlock = kStereoLanes / 2;

// A point of an epipolar line: rectified column from the principal point, raw row. px.
struct LinePoint {
  double column;
  double row;
};

// One rectified row as a function of the raw column.
class Line {
 public:
  // map: raw position of rectified columns 0, 1, ...; first_px: of them, from the principal point.
  Line(std::span<const cv::Vec2f> map, double first_px)
      : map_(map), first_px_(first_px), at_(static_cast<std::ptrdiff_t>(map.size() / 2)) {}

  // Walks from where the last one was, so that what a lens model does far outside of the frame is never met.
  std::optional<LinePoint> At(double raw_column) {
    const auto last = std::ssize(map_) - 2;
    while (at_ > 0 && X(at_) > raw_column) {
      --at_;
    }
    while (at_ < last && X(at_ + 1) <= raw_column) {
      ++at_;
    }
    const double step = X(at_ + 1) - X(at_), part = (raw_column - X(at_)) / step;
    if (!(step > 0 && part >= 0 && part <= 1)) {
      return std::nullopt;
    }
    const double row = (1 - part) * Y(at_) + part * Y(at_ + 1);
    return LinePoint{first_px_ + static_cast<double>(at_) + part, row};
  }

 private:
  double X(std::ptrdiff_t at) const { return static_cast<double>(map_[static_cast<std::size_t>(at)][0]); }
  double Y(std::ptrdiff_t at) const { return static_cast<double>(map_[static_cast<std::size_t>(at)][1]); }

  std::span<const cv::Vec2f> map_;
  double first_px_;
  std::ptrdiff_t at_;
};

void SetParabola(double at0, double at8, double at16, float (&coefficients)[3]) {
  const double bend = (at16 - 2 * at8 + at0) / (2 * kHalfBlock * kHalfBlock);
  coefficients[0] = static_cast<float>(at0);
  coefficients[1] = static_cast<float>((at8 - at0) / kHalfBlock - kHalfBlock * bend);
  coefficients[2] = static_cast<float>(bend);
}

struct Frame {
  ImageSize size;
  double first_px;  // of its columns, from the principal point
};

// Exactly as the kernels compute it.
float Parabola(const float (&coefficients)[3], int lane) {
  const auto x = static_cast<float>(lane);
  return coefficients[0] + x * (coefficients[1] + x * coefficients[2]);
}

struct RowRange {
  int low = std::numeric_limits<int>::max(), high = std::numeric_limits<int>::min();
  bool is_empty() const { return low > high; }
};

// Raw rows below which the line runs inside of the frame, counted from `first`, from which block.row counts.
RowRange RowsInside(int lanes, const Frame& frame, int first, const EpipolarBlock& block) {
  RowRange rows;
  for (int lane = 0; lane < lanes; ++lane) {
    const double from_left = static_cast<double>(Parabola(block.column, lane)) - frame.first_px;
    const int row = static_cast<int>(std::floor(Parabola(block.row, lane)));
    if (from_left >= 0 && from_left <= frame.size.width_px - 1 && first + row >= 0 &&
        first + row < frame.size.height_px - 1) {
      rows.low = std::min(rows.low, row);
      rows.high = std::max(rows.high, row);
    }
  }
  return rows;
}

// The raw rows below which the line runs inside of the frame; its own rows count from the first of them. A
// line on a raw row may be above it once it counts from that row, in single precision: then from the one
// before.
void SetRows(int lanes, const Frame& frame, EpipolarBlock& block) {
  const float row = block.row[0];
  int first = 0;
  RowRange rows = RowsInside(lanes, frame, first, block);
  for (int i = 0; i < 2 && !rows.is_empty() && (i == 0 || rows.low < 0); ++i) {
    first += rows.low;
    block.row[0] = row - static_cast<float>(first);
    rows = RowsInside(lanes, frame, first, block);
  }
  block.first_row = static_cast<std::uint16_t>(first);
  block.row_count = static_cast<std::uint16_t>(rows.is_empty() ? 0 : rows.high + 1);
}

using Nodes = std::vector<std::optional<LinePoint>>;  // at raw columns 0, 8, 16, ...

Nodes NodesOf(Line line, int count) {
  Nodes nodes(static_cast<std::size_t>(count));
  Line leftwards = line;
  for (int i = count / 2; i < count; ++i) {
    nodes[static_cast<std::size_t>(i)] = line.At(kHalfBlock * i);
  }
  for (int i = count / 2 - 1; i >= 0; --i) {
    nodes[static_cast<std::size_t>(i)] = leftwards.At(kHalfBlock * i);
  }
  return nodes;
}

bool SetBlocks(const Nodes& nodes, const Frame& frame, std::span<EpipolarBlock> blocks) {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const auto &first = nodes[2 * b], &middle = nodes[2 * b + 1], &last = nodes[2 * b + 2];
    blocks[b] = {};
    if (!first || !middle || !last) {
      continue;
    }
    if (!(first->column < middle->column && middle->column < last->column)) {
      return false;
    }
    SetParabola(first->row, middle->row, last->row, blocks[b].row);
    SetParabola(first->column, middle->column, last->column, blocks[b].column);
    SetRows(std::min(kStereoLanes, frame.size.width_px - static_cast<int>(b) * kStereoLanes), frame,
            blocks[b]);
  }
  return true;
}

}  // namespace

Result<EpipolarTable> EpipolarTable::Build(const CameraIntrinsics& camera, const cv::Mat& rectification,
                                           const cv::Mat& projection, ImageSize size) {
  constexpr int kStrip = 64;   // rows mapped at a time
  constexpr int kBeside = 64;  // rectified columns looked at on either side of the frame
  cv::Mat camera_matrix, map, unused;
  cv::eigen2cv(camera.camera_matrix, camera_matrix);
  EpipolarTable table;
  table.size_ = size;
  table.blocks_a_row_ = (size.width_px + kStereoLanes - 1) / kStereoLanes;
  const std::size_t count =
      static_cast<std::size_t>(table.blocks_a_row_) * static_cast<std::size_t>(size.height_px);
  ReserveHuge(count, table.blocks_);
  table.blocks_.resize(count);
  for (int row = 0; row < size.height_px; ++row) {
    if (row % kStrip == 0) {
      cv::Mat shifted = projection.clone();
      shifted.at<double>(0, 2) += kBeside;
      shifted.at<double>(1, 2) -= row;
      cv::initUndistortRectifyMap(camera_matrix, camera.distortion, rectification, shifted,
                                  {size.width_px + 2 * kBeside, std::min(kStrip, size.height_px - row)},
                                  CV_32FC2, map, unused);
    }
    const std::span<const cv::Vec2f> line(map.ptr<cv::Vec2f>(row % kStrip),
                                          static_cast<std::size_t>(map.cols));
    const Frame frame = {size, -projection.at<double>(0, 2)};
    const Nodes nodes = NodesOf(Line(line, frame.first_px - kBeside), 2 * table.blocks_a_row_ + 1);
    const auto blocks = static_cast<std::size_t>(table.blocks_a_row_);
    if (!SetBlocks(nodes, frame, {&table.blocks_[static_cast<std::size_t>(row) * blocks], blocks})) {
      return Fail(ErrorCode::kInvalidArgument, "rectified row {} runs backwards through the raw image", row);
    }
  }
  return table;
}

}  // namespace forgescan
