#include "services/reconstruction/view_pool.h"

#include <utility>

#include "services/common/huge_pages.h"

namespace forgescan {
namespace {

bool IsOurs(const cv::Mat& map) { return map.u != nullptr && map.u->refcount == 1; }

void Create(cv::Size size, cv::Mat& map, int type) {
  const std::uint8_t* const before = map.data;
  map.create(size, type);
  if (map.data != before) {
    AdviseHuge(map.data, map.total() * map.elemSize());
  }
}

}  // namespace

void CreateMaps(cv::Size size, DecodedView& view) {
  Create(size, view.coordinate_px, CV_32F);
  Create({size.width, (size.height + 1) / 2}, view.variance_px2, CV_16U);
  Create(size, view.cause, CV_8U);
}

void ViewPool::Give(DecodedView view) {
  constexpr std::size_t kMaxViews = 2;
  const std::lock_guard lock(mutex_);
  if (views_.size() < kMaxViews && IsOurs(view.coordinate_px) && IsOurs(view.variance_px2) &&
      IsOurs(view.cause)) {
    views_.push_back(std::move(view));
  }
}

DecodedView ViewPool::Take(cv::Size size) {
  DecodedView view;
  {
    const std::lock_guard lock(mutex_);
    if (!views_.empty()) {
      view.coordinate_px = std::move(views_.back().coordinate_px);
      view.variance_px2 = std::move(views_.back().variance_px2);
      view.cause = std::move(views_.back().cause);
      views_.pop_back();
    }
  }
  CreateMaps(size, view);
  return view;
}

}  // namespace forgescan
