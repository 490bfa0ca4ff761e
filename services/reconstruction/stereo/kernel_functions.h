// What each of the kernel_<instruction set>.cc makes of the loops.
#pragma once

#include "services/reconstruction/stereo/match_row.h"
#include "services/reconstruction/stereo/point_row.h"
#include "services/reconstruction/stereo/prepare_row.h"
#include "services/reconstruction/stereo/sample_row.h"

namespace forgescan {
namespace {

constexpr StereoKernel MakeStereoKernel(const char* name) {
  return {.name = name,
          .sample = SampleRow,
          .prepare = PrepareRow,
          .match = MatchRow,
          .triangulate = TriangulateRow};
}

}  // namespace
}  // namespace forgescan
