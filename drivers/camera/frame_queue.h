// FrameQueue: where a camera's receiving threads leave frames and its owner's thread finds them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>

#include "drivers/camera/camera.h"

namespace forgescan {

// Thread-safe. A session is the time between a Start() and the next Stop() or loss; what a thread of an ended
// session still pushes is counted as discarded and goes nowhere.
class FrameQueue {
 public:
  using Item = std::variant<CameraFrame, Error>;

  explicit FrameQueue(std::size_t capacity_frames);
  ~FrameQueue();
  FrameQueue(const FrameQueue&) = delete;
  FrameQueue& operator=(const FrameQueue&) = delete;

  // Whether the descriptor could be made; everything else works only if so.
  bool valid() const { return fd_ >= 0; }
  int fd() const { return fd_; }

  // Starts a session and returns its number; what waited is discarded.
  std::uint64_t Open();
  // Ends the session; what waited is discarded.
  void Close();

  void Push(std::uint64_t session, CameraFrame frame);
  void PushLost(std::uint64_t session, Error error);

  // Makes fd() unreadable until the next push, and says how many items wait.
  std::size_t Acknowledge();
  std::optional<Item> Pop();

  // Only the four frames_* counters are set.
  CameraCounters counters() const;

 private:
  void Discard();
  void Signal();

  const std::size_t capacity_frames_;
  int fd_ = -1;
  mutable std::mutex mutex_;
  std::deque<Item> items_;
  std::uint64_t session_ = 0;
  bool open_ = false;
  CameraCounters counters_;
};

}  // namespace forgescan
