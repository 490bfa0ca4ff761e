// AravisSession: one connection to one GigE Vision camera, from opening it to letting it go. Internal to
// camera_aravis.cc.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>

#include "drivers/camera/camera_aravis.h"
#include "drivers/camera/frame_queue.h"

// Aravis' own types, named here so that its header stays in aravis_session.cc.
struct _ArvBuffer;
struct _ArvCamera;
struct _ArvChunkParser;
struct _ArvStream;

namespace forgescan {

struct GObjectRelease {
  void operator()(void* object) const;
};
template <typename T>
using GObjectPointer = std::unique_ptr<T, GObjectRelease>;

// Made and asked on the owner's thread, destroyed on any; the destructor waits for the device (ms, or up to 8
// s if gone).
class AravisSession {
 public:
  // Frames and the loss go to `queue` as session `id`; the queue outlives the session.
  AravisSession(const CameraAravisOptions& options, FrameQueue& queue, std::uint64_t id);
  ~AravisSession();
  AravisSession(const AravisSession&) = delete;
  AravisSession& operator=(const AravisSession&) = delete;

  // Opens, configures, arms and starts; errors as Camera::Start(). Once.
  Status Open();
  // Everything but the frames_* counters.
  CameraCounters counters() const;

  // For Aravis' callbacks, on its threads.
  void AskForPriority();
  void ReportLoss();

 private:
  Status ConfigureControl();
  Status ConfigureImage();
  Status ConfigureTransport();
  Status CreateStream();
  Status Run();
  void PopLoop();
  CameraFrame Convert(_ArvBuffer* buffer);
  bool ReadChunks(_ArvBuffer* buffer, CameraFrame& frame);

  const CameraAravisOptions options_;
  FrameQueue& queue_;
  const std::uint64_t id_;
  GObjectPointer<_ArvCamera> camera_;
  GObjectPointer<_ArvStream> stream_;
  GObjectPointer<_ArvChunkParser> chunk_parser_;
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> chunk_errors_ = 0;
  std::atomic<std::uint64_t> realtime_refused_ = 0;
  std::thread pop_thread_;
};

}  // namespace forgescan
