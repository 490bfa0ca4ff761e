#include "services/reconstruction/view_pool.h"

#include <utility>

namespace forgescan {
namespace {

bool IsOurs(const cv::Mat& map) { return map.u != nullptr && map.u->refcount == 1; }

}  // namespace

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
  view.coordinate_px.create(size);
  view.variance_px2.create(size);
  view.cause.create(size);
  return view;
}

}  // namespace forgescan
