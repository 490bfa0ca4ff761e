#include "drivers/camera/queued_camera.h"

namespace forgescan {

// Delivers at most what waited on entry, so that a fast camera cannot keep the owner here for ever.
void QueuedCamera::Dispatch() {
  const std::size_t waiting = queue_.Acknowledge();
  for (std::size_t i = 0; i < waiting; ++i) {
    auto item = queue_.Pop();
    if (!item) {
      return;  // a handler called Stop()
    }
    if (auto* frame = std::get_if<CameraFrame>(&*item)) {
      if (handler_) {
        handler_(std::move(*frame));
      }
      continue;
    }
    state_ = State::kLost;
    ++devices_lost_;
    queue_.Close();
    OnLost();
    if (lost_handler_) {
      lost_handler_(std::get<Error>(*item));
    }
    return;
  }
}

}  // namespace forgescan
