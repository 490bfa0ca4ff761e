// QueuedCamera: the half of a Camera that every driver shares, namely handlers, states and delivery on the
// owner's thread.
#pragma once

#include <cstddef>
#include <utility>

#include "drivers/camera/camera.h"
#include "drivers/camera/frame_queue.h"

namespace forgescan {

class QueuedCamera : public Camera {
 public:
  State state() const override { return state_; }
  void SetHandler(FrameHandler handler) override { handler_ = std::move(handler); }
  void SetLostHandler(LostHandler handler) override { lost_handler_ = std::move(handler); }
  int fd() const override { return queue_.fd(); }
  void Dispatch() override;

 protected:
  explicit QueuedCamera(std::size_t capacity_frames) : queue_(capacity_frames) {}

  // Called on the owner's thread just before the lost handler: lets go of the device.
  virtual void OnLost() = 0;

  FrameQueue queue_;
  State state_ = State::kClosed;
  std::uint64_t devices_lost_ = 0;

 private:
  FrameHandler handler_;
  LostHandler lost_handler_;
};

}  // namespace forgescan
