// Point clouds on the bus: cut into slices that one message can carry, and put together again.
//
// A point is 30 bytes, little-endian: float32 x y z (mm), float32 nx ny nz, float32 sigma (mm), uint16 view.
#pragma once

#include <optional>
#include <tuple>
#include <vector>

#include "fsmsg/cloud_slice_t.hpp"
#include "services/common/aged_map.h"
#include "services/common/geometry/point_cloud.h"
#include "services/common/result.h"

namespace forgescan {

inline constexpr int kAllViews = -1;

// Slices of at most 4 MB; an empty cloud is one empty slice. `cloud` has normals, sigma_mm and view for every
// point. Errors: kInvalidArgument (a member is missing).
Result<std::vector<fsmsg::cloud_slice_t>> SliceCloud(const PointCloud& cloud, std::int64_t utime, int part,
                                                     int view);

// Collects slices of several clouds at once, in any order. Slices belong together if part, view and utime are
// equal: another attempt at a view, or another part with the same number, is another cloud. At most 8 clouds
// are open; a further one takes the place of the oldest, which on a stream has lost slices that the bus has
// counted. Memory: what has come, whatever the slices say of the rest; twice that while the last one is
// added.
class CloudAssembler {
 public:
  static constexpr std::size_t kMaxOpen = 8;

  // The whole cloud when this was its last slice; nothing while slices are missing.
  // Errors: kFormat (sizes that contradict each other, slices that are not the cloud's points one after the
  // other); the cloud's slices so far are dropped then.
  Result<std::optional<PointCloud>> Add(const fsmsg::cloud_slice_t& slice);
  // Drops what has come of a part that will not be finished: all of it, or the clouds of this utime.
  void Forget(int part);
  void Forget(int part, std::int64_t utime);

 private:
  struct Open {
    std::size_t points_total = 0;
    std::vector<std::optional<fsmsg::cloud_slice_t>> slices;
    std::size_t missing = 0;
  };
  // The open cloud of a consistent slice, begun if it is the first.
  Open& OpenFor(const fsmsg::cloud_slice_t& slice);

  using Key = std::tuple<std::int32_t, std::int32_t, std::int64_t>;  // part, view, utime
  AgedMap<Key, Open> open_{kMaxOpen};
};

}  // namespace forgescan
