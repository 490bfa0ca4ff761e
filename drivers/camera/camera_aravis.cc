#include "drivers/camera/camera_aravis.h"

#include <arpa/inet.h>

#include <chrono>
#include <utility>

#include "drivers/camera/aravis_session.h"

namespace forgescan {
namespace {

Status InRange(const char* name, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value < low || value > high) {
    return Fail(ErrorCode::kInvalidArgument, "camera option {} is {}, must be {}..{}", name, value, low,
                high);
  }
  return {};
}

CameraCounters& operator+=(CameraCounters& sum, const CameraCounters& term) {
  sum.chunk_errors += term.chunk_errors;
  sum.packets_missing += term.packets_missing;
  sum.packets_resent += term.packets_resent;
  sum.packets_duplicated += term.packets_duplicated;
  sum.packets_unbuffered += term.packets_unbuffered;
  sum.resend_requests += term.resend_requests;
  sum.realtime_refused += term.realtime_refused;
  return sum;
}

}  // namespace

Status CameraAravisOptions::Check() const {
  in_addr parsed{};
  if (::inet_pton(AF_INET, address.c_str(), &parsed) != 1) {
    return Fail(ErrorCode::kInvalidArgument, "camera option address is \"{}\", must be an IPv4 address",
                address);
  }
  RETURN_IF_ERROR(InRange("width_px", width_px, 1, 65535));
  RETURN_IF_ERROR(InRange("height_px", height_px, 1, 65535));
  RETURN_IF_ERROR(InRange("exposure_us", exposure_us, 1, 10'000'000));
  RETURN_IF_ERROR(InRange("packet_size_bytes", packet_size_bytes, 576, 16380));
  RETURN_IF_ERROR(InRange("packet_delay_ns", packet_delay_ns, 0, 1'000'000'000));
  RETURN_IF_ERROR(InRange("packet_timeout_ms", packet_timeout_ms, 1, 1000));
  RETURN_IF_ERROR(InRange("frame_retention_ms", frame_retention_ms, 2 * packet_timeout_ms, 60'000));
  RETURN_IF_ERROR(InRange("socket_buffer_bytes", socket_buffer_bytes, 65'536, 1 << 30));
  RETURN_IF_ERROR(InRange("buffers", buffers, 2, 1000));
  RETURN_IF_ERROR(
      InRange("queue_capacity_frames", static_cast<std::int64_t>(queue_capacity_frames), 1, 100'000));
  RETURN_IF_ERROR(InRange("heartbeat_timeout_ms", heartbeat_timeout_ms, 1600, 60'000));
  return InRange("teardown_wait_ms", teardown_wait_ms, 0, 60'000);
}

CameraAravis::CameraAravis(CameraAravisOptions options)
    : QueuedCamera(options.queue_capacity_frames), options_(std::move(options)) {}

CameraAravis::~CameraAravis() { Stop(); }

Status CameraAravis::Start() {
  RETURN_IF_ERROR(options_.Check());
  if (state_ == State::kStreaming) {
    return Fail(ErrorCode::kInvalidArgument, "camera {}: Start() while streaming", options_.address);
  }
  if (!queue_.valid()) {
    return Fail(ErrorCode::kIo, "camera {}: the system gives no event descriptor", options_.address);
  }
  const auto patience = std::chrono::milliseconds(options_.teardown_wait_ms);
  if (teardown_.valid() && teardown_.wait_for(patience) != std::future_status::ready) {
    return Fail(ErrorCode::kUnavailable, "camera {}: the earlier session is still being torn down",
                options_.address);
  }
  session_ = std::make_unique<AravisSession>(options_, queue_, queue_.Open());
  if (Status opened = session_->Open(); !opened.ok()) {
    queue_.Close();
    Release();
    return opened;
  }
  state_ = State::kStreaming;
  return {};
}

void CameraAravis::Stop() {
  queue_.Close();
  Release();
  state_ = State::kClosed;
}

// A lost device makes Aravis wait for answers that do not come, so it is let go of elsewhere.
void CameraAravis::Release() {
  if (!session_) {
    return;
  }
  ended_sessions_ += session_->counters();
  teardown_ = std::async(std::launch::async, [session = std::move(session_)]() mutable { session.reset(); });
}

CameraCounters CameraAravis::counters() const {
  CameraCounters counters = queue_.counters();
  counters += ended_sessions_;
  counters.devices_lost = devices_lost_;
  if (session_) {
    counters += session_->counters();
  }
  return counters;
}

}  // namespace forgescan
