// CameraAravis: a GigE Vision camera on a real network, through the Aravis library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <string>

#include "drivers/camera/queued_camera.h"

namespace forgescan {

class AravisSession;

// The defaults are measured for 2448 x 2048 frames on a 1 Gbit/s link and a plain UDP socket.
struct CameraAravisOptions {
  std::string address;  // IPv4 in dotted form: opening by address needs no broadcast and takes milliseconds
  int width_px = 2448;
  int height_px = 2048;
  std::int64_t exposure_us = 10000;
  std::string trigger_source = "Line0";
  int packet_size_bytes = 9000;      // IP packet; the whole path must carry it. Read back after setting.
  std::int64_t packet_delay_ns = 0;  // between packets; 0 where cameras take turns on the link
  int packet_timeout_ms = 5;         // silence before a hole is asked for again; below 5 duplicates begin
  // Longest wait for the rest of a frame. Some cameras send the first packet of a frame long before its
  // trigger; this Aravis then counts from there, so with such cameras it must exceed the longest pause
  // between triggers.
  int frame_retention_ms = 1000;
  // Of the receive socket; the system caps it at net.core.rmem_max. Too small loses packets whenever this
  // host pauses; they are asked for again, at the price of packet_timeout_ms. It takes effect at the first
  // packet, so the first frame after Start() has the system's default (net.core.rmem_default).
  int socket_buffer_bytes = 32 * 1024 * 1024;
  int buffers = 24;                        // receive buffers: at least one whole sequence of patterns
  std::size_t queue_capacity_frames = 64;  // waiting for Dispatch()
  // How long the camera stays with a host it no longer hears, and refuses another one. Aravis is heard once a
  // second and repeats a lost question after 0.5 s, so less than 1500 would give up a camera for one packet.
  int heartbeat_timeout_ms = 1600;
  int teardown_wait_ms = 1000;  // how long Start() waits for an earlier session to be gone
  bool realtime_thread = true;  // ask for real-time priority on the receive thread; a refusal is counted

  // Errors: kInvalidArgument with the member, its value and its range.
  Status Check() const;
};

// States and rules as in Camera. Start() takes milliseconds with a camera that answers and 2.5 s with an
// address that does not. Tearing down a lost device takes up to 8 s inside Aravis; it runs on a thread of its
// own and Stop() does not wait for it, but Start() does (teardown_wait_ms, then kUnavailable), and so does
// the destructor.
//
// A cable pulled is noticed after about 5 s (five unanswered heartbeats); whoever knows when a frame is due
// should not wait for that, but keep deadlines of its own.
class CameraAravis : public QueuedCamera {
 public:
  explicit CameraAravis(CameraAravisOptions options);
  ~CameraAravis() override;

  Status Start() override;
  void Stop() override;
  CameraCounters counters() const override;

 private:
  void OnLost() override { Release(); }
  void Release();

  const CameraAravisOptions options_;
  std::unique_ptr<AravisSession> session_;
  std::future<void> teardown_;
  CameraCounters ended_sessions_;  // stream counters of sessions that are gone
};

}  // namespace forgescan
