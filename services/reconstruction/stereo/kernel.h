// The inner loops of stereo, one set of functions for each instruction set; all of them give the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace forgescan {

constexpr int kStereoLanes = 16;    // pixels of a block
constexpr int kRowMargin = 64;      // floats that may be read before and behind a row; NaN
constexpr int kMaxSegments = 64;    // of a row; more is no surface
constexpr int kSegmentMargin = 64;  // floats behind each segment's ranks

// Where the epipolar line of one rectified row runs through 16 columns of a raw image, at column 16 block +
// i: raw row = first_row + row[0] + i (row[1] + i row[2]), rectified column = column[0] + ..., measured from
// the principal point. px.
struct EpipolarBlock {
  float row[3];
  float column[3];
  std::uint16_t first_row;  // the line runs between the raw rows first_row .. first_row + row_count
  std::uint16_t row_count;  // 0: it is outside of the image
};

// Raw images; strides in elements.
struct RawView {
  const float* coordinate_px;         // NaN: masked
  const std::uint16_t* variance_px2;  // upper halves of floats, of even rows only
  std::ptrdiff_t coordinate_stride, variance_stride;
  int width, height;
  float max_step_px;  // largest difference of two neighbours on one surface
  float sign;         // makes coordinates ascend along a row
};

// Pixels begin .. end - 1 of a row whose coordinates ascend, gaps included.
struct RowSegment {
  int begin, end;
  int ranks;  // where in StereoRow::ranks its coordinates begin
  float low, high;
};

// What is known along one epipolar line, at the raw columns. All arrays have kRowMargin readable floats at
// either end.
struct StereoRow {
  float* raw_px;         // coordinate between two raw rows; NaN: none
  float* coordinate_px;  // the same, smoothed along the row
  float* variance_px2;   // once prepared, NaN where neither neighbour is of the same surface
  float* column_px;      // rectified, from the principal point
  float* ranks;          // coordinates of the segments, gaps filled from the left, +inf behind each
  RowSegment* segments;  // kMaxSegments
  int segment_count;     // kMaxSegments + 1: too many
};

struct SlopeLimits {
  float low, high;   // projector px per camera px, both > 0
  float max_off_px;  // of a pixel from the parabola through it and its neighbours
};

struct MatchLimits {
  SlopeLimits left, right;
  float max_left_right_px;  // how far there and back may be from where it began
};

// The line of a view whose surroundings the next rows will read.
struct FetchTask {
  const RawView* view;
  const EpipolarBlock* line;
};

// Where the partners of a block's pixels were in the row above: at begin + index of the row's ranks. Any
// numbers will do.
struct MatchHint {
  int begin;
  std::int32_t index[kStereoLanes];
};

// Disparity of the left pixels of a row, from the principal points. NaN: none.
struct DisparityRow {
  float* disparity_px;
  float* variance_px2;
};

// hints: one a block. next: of the right view.
struct MatchTask {
  const StereoRow *left, *right;
  MatchLimits limits;
  int blocks;
  FetchTask next;
  MatchHint* hints;
};

struct MatchCounts {
  long candidates = 0, no_partner = 0, ambiguous = 0, left_right = 0;
};

// Pose from the rectified left camera, OpenCV's lens model, and how far the column a point shows may be from
// the one that lights it: max_residual_px, or so many sigma of the coordinate, whichever is more.
struct ProjectorModel {
  float rotation[9], translation_mm[3];
  float focal_px, center_px;
  float distortion[12];
  float tilt[9];  // of the sensor
  float max_residual_px, max_residual_sigma;
};

struct PointGeometry {
  float inverse_focal, focal_times_baseline, row_px;  // 1/px, px mm, px; the row from the principal point
  float min_depth_mm, max_depth_mm;
  float squared_min_cosine, max_slope_per_disparity;
  int radius_px;
  float sign;                       // see RawView
  const ProjectorModel* projector;  // null: none
};

// One of a row's results, one behind the other, and where they are to be in the end: whole cache lines, 16
// floats, go there past the cache as soon as they are full. What lies before the target's first line and
// behind what is streamed is left to the caller. target: null, nowhere.
struct PointArray {
  float* values;
  float* target;
  std::ptrdiff_t streamed;  // values up to here, counted from the first one; at first those before the line
};

// A row's points; room for all pixels and 16 more.
struct PointRow {
  PointArray points_mm;  // x y z
  PointArray normals;    // x y z
  PointArray sigma_mm;
  float* coordinate_px;
  float* residual_px;  // shown column minus the projector's, of residual_count points, those included that go
                       // for it
  int count, residual_count;
  long depth_range, no_normal, steep, projector;
};

// rows: disparities of the 2 radius + 1 rows around, NaN rows outside of the image. above, here, below:
// blocks of the epipolar table. sums, moments: scratch rows with margins. next: of the left view.
struct PointTask {
  const float* const* rows;
  const StereoRow* left;
  const DisparityRow* disparity;
  const EpipolarBlock *above, *here, *below;
  float *sums, *moments;
  int blocks;
  FetchTask next;
};

struct StereoKernel {
  const char* name;
  void (*sample)(const RawView& view, const EpipolarBlock* blocks, const StereoRow& row);
  void (*prepare)(int blocks, const SlopeLimits& limits, StereoRow& row);
  MatchCounts (*match)(const MatchTask& task, const DisparityRow& disparity);
  void (*triangulate)(const PointTask& task, const PointGeometry& geometry, PointRow& points);
};

// Those this processor can run, the fastest first; the last one runs everywhere.
std::span<const StereoKernel* const> StereoKernels();

}  // namespace forgescan
