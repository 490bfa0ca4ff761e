#include "drivers/camera/frame_queue.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <utility>

namespace forgescan {

FrameQueue::FrameQueue(std::size_t capacity_frames)
    : capacity_frames_(capacity_frames), fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

FrameQueue::~FrameQueue() {
  if (valid()) {
    ::close(fd_);
  }
}

std::uint64_t FrameQueue::Open() {
  const std::lock_guard lock(mutex_);
  Discard();
  open_ = true;
  return ++session_;
}

void FrameQueue::Close() {
  const std::lock_guard lock(mutex_);
  Discard();
  open_ = false;
}

void FrameQueue::Push(std::uint64_t session, CameraFrame frame) {
  const std::lock_guard lock(mutex_);
  if (!open_ || session != session_) {
    ++counters_.frames_discarded;
    return;
  }
  if (items_.size() >= capacity_frames_) {
    ++counters_.frames_overflowed;
    return;
  }
  ++(frame.complete ? counters_.frames_complete : counters_.frames_incomplete);
  items_.emplace_back(std::move(frame));
  Signal();
}

void FrameQueue::PushLost(std::uint64_t session, Error error) {
  const std::lock_guard lock(mutex_);
  if (!open_ || session != session_) {
    return;
  }
  items_.emplace_back(std::move(error));  // whatever the capacity: a loss must be heard
  Signal();
}

std::size_t FrameQueue::Acknowledge() {
  std::uint64_t ignored = 0;
  while (::read(fd_, &ignored, sizeof ignored) > 0) {
  }
  const std::lock_guard lock(mutex_);
  return items_.size();
}

std::optional<FrameQueue::Item> FrameQueue::Pop() {
  const std::lock_guard lock(mutex_);
  if (items_.empty()) {
    return std::nullopt;
  }
  Item item = std::move(items_.front());
  items_.pop_front();
  return item;
}

CameraCounters FrameQueue::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void FrameQueue::Discard() {
  for (const Item& item : items_) {
    counters_.frames_discarded += std::holds_alternative<CameraFrame>(item) ? 1U : 0U;
  }
  items_.clear();
}

// An eventfd write fails only at 2^64 - 2 unread pushes, so there is nothing to report.
void FrameQueue::Signal() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
}

}  // namespace forgescan
