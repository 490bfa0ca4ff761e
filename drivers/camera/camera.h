// Camera: what a camera service needs from a hardware-triggered area camera, and nothing of how it is wired.
//
//            Start() fails: stays           device gone (seen by Dispatch)
//              +--+                        +------------------------+
//              v  |                        |                        v
//            kClosed ---- Start() ----> kStreaming               kLost
//              ^                           |   ^                    |
//              +---------- Stop() ---------+   +----- Start() ------+
//              +------------------------- Stop() -------------------+
//
// Start() opens, configures and arms in one step: a camera that is open but not streaming is of no use to a
// line that is triggered by wire, so that state does not exist for the owner.
//
// Threads: every call is made on ONE thread, the owner's. Frames are received on threads of the driver and
// wait in a queue; fd() becomes readable, and Dispatch() calls the handlers on the owner's thread. Handlers
// may call Stop(), not Start().
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

// One exposure as the camera reports it. Shape: pixels = height_px rows of width_px bytes (8-bit grey), row
// by row, no padding.
struct CameraFrame {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> pixels;  // empty if !complete: part of an image is not an image
  std::uint64_t frame_id =
      0;  // block id of the wire: 16 bit, 65535 is followed by 1; 0 = UNKNOWN, only if !complete
  std::int64_t device_time_us = 0;  // camera clock at the trigger edge; 0 = UNKNOWN, only if !complete
  std::int64_t exposure_us = 0;     // what the camera says it exposed; 0 = UNKNOWN, only if !complete
  bool complete = false;            // every pixel, the id, the time and the exposure arrived
};

// Everything that was not delivered as a complete frame is in one of these; they never decrease.
struct CameraCounters {
  std::uint64_t frames_complete = 0;    // put in the queue with complete = true
  std::uint64_t frames_incomplete = 0;  // put in the queue with complete = false
  std::uint64_t frames_overflowed = 0;  // received, but the owner did not Dispatch() and the queue was full
  std::uint64_t frames_discarded = 0;   // in the queue, or still arriving, when Stop() or a new Start() came
  std::uint64_t chunk_errors =
      0;  // all packets arrived, but id, time or exposure were missing or contradictory
  std::uint64_t packets_missing = 0;  // from the first hole to the end of an incomplete frame
  std::uint64_t packets_resent = 0;   // repaired by a resend
  std::uint64_t packets_duplicated = 0;
  std::uint64_t packets_unbuffered = 0;  // arrived while no receive buffer was free
  std::uint64_t resend_requests = 0;
  std::uint64_t devices_lost = 0;      // transitions to kLost
  std::uint64_t triggers_ignored = 0;  // known to a simulated camera only: triggered while not streaming
  std::uint64_t realtime_refused = 0;  // sessions whose receive thread got no real-time priority
};

class Camera {
 public:
  enum class State { kClosed, kStreaming, kLost };
  using FrameHandler = std::function<void(CameraFrame)>;
  using LostHandler = std::function<void(const Error&)>;

  virtual ~Camera() = default;
  Camera() = default;
  Camera(const Camera&) = delete;
  Camera& operator=(const Camera&) = delete;

  // Opens, configures and arms the camera. Legal in kClosed and kLost.
  // Errors: kInvalidArgument (options, already streaming), kUnavailable (no answer, held by another host, or
  // an earlier session is still being torn down: try again), kProtocol (the camera refuses or changes a
  // setting).
  virtual Status Start() = 0;
  // Legal in every state; afterwards no handler is called, and the state is kClosed. Never waits for the
  // network.
  virtual void Stop() = 0;
  virtual State state() const = 0;

  // Set both before Start().
  virtual void SetHandler(FrameHandler handler) = 0;
  virtual void SetLostHandler(LostHandler handler) = 0;

  // Readable while frames or a loss wait; one descriptor for the life of the object.
  virtual int fd() const = 0;
  // Hands over what waits, in order of arrival; a loss comes after the frames received before it.
  virtual void Dispatch() = 0;

  virtual CameraCounters counters() const = 0;
};

}  // namespace forgescan
