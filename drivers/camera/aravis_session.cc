#include "drivers/camera/aravis_session.h"

#include <arv.h>

#include <functional>
#include <string>
#include <utility>

namespace forgescan {
namespace {

constexpr std::uint64_t kPopTimeout_us = 50'000;  // how soon a receiving thread notices that it shall end
constexpr int kRealtimePriority = 10;
constexpr int kNiceLevel = -10;
constexpr std::uint64_t kHeartbeatTimeoutRegister = 0x0938;  // GigE Vision bootstrap register, ms
constexpr char kChunks[] = "FrameID,Timestamp,ExposureTime";

void OnStreamEvent(void* self, ArvStreamCallbackType type, ArvBuffer* /*buffer*/) {
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT) {
    static_cast<AravisSession*>(self)->AskForPriority();
  }
}

void OnControlLost(ArvDevice* /*device*/, void* self) { static_cast<AravisSession*>(self)->ReportLoss(); }

// Runs one Aravis call and turns its GError into ours: "192.168.0.5: cannot set the region: ...".
Status Attempt(const std::string& address, const char* what, const std::function<void(GError**)>& call) {
  GError* error = nullptr;
  call(&error);
  if (error == nullptr) {
    return {};
  }
  // A camera that does not answer, or that another host controls, may do so later; a refused setting stays
  // refused.
  const bool may_recover =
      g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT) ||
      g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) ||
      g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_CONNECTED) ||
      g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_CONTROLLER) ||
      g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED);
  const std::string reason = error->message;
  g_error_free(error);
  return Fail(may_recover ? ErrorCode::kUnavailable : ErrorCode::kProtocol, "camera {}: cannot {}: {}",
              address, what, reason);
}

}  // namespace

void GObjectRelease::operator()(void* object) const { g_object_unref(object); }

AravisSession::AravisSession(const CameraAravisOptions& options, FrameQueue& queue, std::uint64_t id)
    : options_(options), queue_(queue), id_(id) {}

Status AravisSession::Open() {
  RETURN_IF_ERROR(Attempt(options_.address, "open it", [this](GError** error) {
    camera_.reset(arv_camera_new(options_.address.c_str(), error));
  }));
  if (!camera_ || !arv_camera_is_gv_device(camera_.get())) {
    return Fail(ErrorCode::kProtocol, "camera {}: not a GigE Vision device", options_.address);
  }
  if (!arv_gv_device_is_controller(ARV_GV_DEVICE(arv_camera_get_device(camera_.get())))) {
    return Fail(ErrorCode::kUnavailable, "camera {}: another host controls it", options_.address);
  }
  g_signal_connect(arv_camera_get_device(camera_.get()), "control-lost", G_CALLBACK(OnControlLost), this);
  RETURN_IF_ERROR(ConfigureControl());
  RETURN_IF_ERROR(ConfigureImage());
  RETURN_IF_ERROR(ConfigureTransport());
  RETURN_IF_ERROR(CreateStream());
  return Run();
}

Status AravisSession::ConfigureControl() {
  return Attempt(options_.address, "set the heartbeat timeout", [this](GError** error) {
    arv_device_write_register(arv_camera_get_device(camera_.get()), kHeartbeatTimeoutRegister,
                              static_cast<guint32>(options_.heartbeat_timeout_ms), error);
  });
}

Status AravisSession::ConfigureImage() {
  ArvCamera* camera = camera_.get();
  const std::string& address = options_.address;
  arv_camera_set_range_check_policy(camera, ARV_RANGE_CHECK_POLICY_ENABLE);
  RETURN_IF_ERROR(Attempt(address, "set the region", [&](GError** error) {
    arv_camera_set_region(camera, 0, 0, options_.width_px, options_.height_px, error);
  }));
  RETURN_IF_ERROR(Attempt(address, "set the pixel format to Mono8", [&](GError** error) {
    arv_camera_set_pixel_format(camera, ARV_PIXEL_FORMAT_MONO_8, error);
  }));
  RETURN_IF_ERROR(Attempt(address, "set continuous acquisition", [&](GError** error) {
    arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, error);
  }));
  if (arv_camera_is_exposure_auto_available(camera, nullptr)) {
    RETURN_IF_ERROR(Attempt(address, "switch automatic exposure off", [&](GError** error) {
      arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, error);
    }));
  }
  if (arv_camera_is_gain_auto_available(camera, nullptr)) {
    RETURN_IF_ERROR(Attempt(address, "switch automatic gain off",
                            [&](GError** error) { arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, error); }));
  }
  RETURN_IF_ERROR(Attempt(address, "arm the trigger line", [&](GError** error) {
    arv_camera_set_trigger(camera, options_.trigger_source.c_str(), error);
  }));
  return Attempt(address, "set the exposure time", [&](GError** error) {
    arv_camera_set_exposure_time(camera, static_cast<double>(options_.exposure_us), error);
  });
}

Status AravisSession::ConfigureTransport() {
  ArvCamera* camera = camera_.get();
  const std::string& address = options_.address;
  RETURN_IF_ERROR(Attempt(address, "set the packet size", [&](GError** error) {
    arv_camera_gv_set_packet_size(camera, options_.packet_size_bytes, error);
  }));
  guint packet_size_bytes = 0;
  RETURN_IF_ERROR(Attempt(address, "read the packet size back", [&](GError** error) {
    packet_size_bytes = arv_camera_gv_get_packet_size(camera, error);
  }));
  if (packet_size_bytes != static_cast<guint>(options_.packet_size_bytes)) {
    return Fail(ErrorCode::kProtocol, "camera {}: took a packet size of {} bytes instead of {}", address,
                packet_size_bytes, options_.packet_size_bytes);
  }
  RETURN_IF_ERROR(Attempt(address, "set the packet delay", [&](GError** error) {
    arv_camera_gv_set_packet_delay(camera, options_.packet_delay_ns, error);
  }));
  RETURN_IF_ERROR(Attempt(address, "enable the chunks FrameID, Timestamp and ExposureTime",
                          [&](GError** error) { arv_camera_set_chunks(camera, kChunks, error); }));
  chunk_parser_.reset(arv_camera_create_chunk_parser(camera));
  if (!chunk_parser_) {
    return Fail(ErrorCode::kProtocol, "camera {}: its description has no readable chunks", address);
  }
  return {};
}

Status AravisSession::CreateStream() {
  // As root Aravis would silently take a packet socket, with other delays and losses; always the same kind
  // instead.
  arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  RETURN_IF_ERROR(Attempt(options_.address, "open the stream", [this](GError** error) {
    stream_.reset(arv_camera_create_stream(camera_.get(), OnStreamEvent, this, error));
  }));
  if (!stream_ || !ARV_IS_GV_STREAM(stream_.get())) {
    return Fail(ErrorCode::kProtocol, "camera {}: gives no GigE Vision stream", options_.address);
  }
  // packet-request-ratio 1: the default stops repairing a frame once a quarter of it is missing, which a
  // short pause of the host is enough for.
  g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
               static_cast<gint>(options_.socket_buffer_bytes), "packet-resend",
               ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-request-ratio", 1.0, "packet-timeout",
               static_cast<guint>(options_.packet_timeout_ms * 1000), "frame-retention",
               static_cast<guint>(options_.frame_retention_ms * 1000), nullptr);
  // Only now: chunks and region are part of the payload.
  guint payload_bytes = 0;
  RETURN_IF_ERROR(Attempt(options_.address, "read the payload size", [&](GError** error) {
    payload_bytes = arv_camera_get_payload(camera_.get(), error);
  }));
  const std::int64_t image_bytes = static_cast<std::int64_t>(options_.width_px) * options_.height_px;
  if (static_cast<std::int64_t>(payload_bytes) < image_bytes) {
    return Fail(ErrorCode::kProtocol, "camera {}: payload of {} bytes is less than the image of {}",
                options_.address, payload_bytes, image_bytes);
  }
  for (int i = 0; i < options_.buffers; ++i) {
    arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload_bytes));
  }
  return {};
}

Status AravisSession::Run() {
  pop_thread_ = std::thread([this] { PopLoop(); });
  return Attempt(options_.address, "start the acquisition",
                 [this](GError** error) { arv_camera_start_acquisition(camera_.get(), error); });
}

AravisSession::~AravisSession() {
  if (stream_) {
    arv_camera_stop_acquisition(camera_.get(),
                                nullptr);  // its failure changes nothing: the session ends either way
  }
  stop_ = true;
  if (pop_thread_.joinable()) {
    pop_thread_.join();
  }
  chunk_parser_.reset();
  stream_.reset();
  camera_.reset();  // joins the heartbeat thread, which may still call OnControlLost until here
}

void AravisSession::PopLoop() {
  while (!stop_) {
    ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream_.get(), kPopTimeout_us);
    if (buffer == nullptr) {
      continue;
    }
    queue_.Push(id_, Convert(buffer));
    // So that a frame whose first packet is lost does not show the id and time of an older frame.
    arv_buffer_set_timestamp(buffer, 0);
    arv_buffer_set_frame_id(buffer, 0);
    arv_stream_push_buffer(stream_.get(), buffer);
  }
}

CameraFrame AravisSession::Convert(ArvBuffer* buffer) {
  CameraFrame frame;
  frame.width_px = options_.width_px;
  frame.height_px = options_.height_px;
  frame.frame_id = arv_buffer_get_frame_id(buffer);
  frame.device_time_us = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer) / 1000);
  if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) {
    return frame;
  }
  size_t size_bytes = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer, &size_bytes));
  const auto image_bytes = static_cast<size_t>(options_.width_px) * static_cast<size_t>(options_.height_px);
  const bool fits = arv_buffer_get_image_width(buffer) == options_.width_px &&
                    arv_buffer_get_image_height(buffer) == options_.height_px && size_bytes >= image_bytes;
  if (!fits || !ReadChunks(buffer, frame)) {
    ++chunk_errors_;
    return frame;
  }
  frame.pixels.assign(data, data + image_bytes);
  frame.complete = true;
  return frame;
}

// The chunks must confirm what the frame's first packet said: a camera whose two answers differ cannot be
// paired.
bool AravisSession::ReadChunks(ArvBuffer* buffer, CameraFrame& frame) {
  GError* error = nullptr;
  const auto integer = [&](const char* name) {
    return error == nullptr ? arv_chunk_parser_get_integer_value(chunk_parser_.get(), buffer, name, &error)
                            : 0;
  };
  const auto timestamp_ns = static_cast<std::uint64_t>(integer("ChunkTimestamp"));
  integer("ChunkFrameID");  // must be there; its width and start differ between makers, so its value proves
                            // nothing
  double exposure_us = 0;
  if (error == nullptr) {
    exposure_us = arv_chunk_parser_get_float_value(chunk_parser_.get(), buffer, "ChunkExposureTime", &error);
  }
  const bool ok = error == nullptr && timestamp_ns == arv_buffer_get_timestamp(buffer) && exposure_us > 0;
  g_clear_error(&error);
  frame.exposure_us = ok ? static_cast<std::int64_t>(exposure_us + 0.5) : 0;
  return ok;
}

// On the receive thread, once.
void AravisSession::AskForPriority() {
  if (options_.realtime_thread && !arv_make_thread_realtime(kRealtimePriority)) {
    ++realtime_refused_;
    arv_make_thread_high_priority(kNiceLevel);
  }
}

// On the heartbeat thread.
void AravisSession::ReportLoss() {
  queue_.PushLost(
      id_, Fail(ErrorCode::kUnavailable, "camera {}: lost, it no longer answers or obeys", options_.address));
}

CameraCounters AravisSession::counters() const {
  CameraCounters counters;
  counters.chunk_errors = chunk_errors_;
  counters.realtime_refused = realtime_refused_;
  if (stream_) {
    const auto info = [this](const char* name) {
      return arv_stream_get_info_uint64_by_name(stream_.get(), name);
    };
    counters.packets_missing = info("n_missing_packets");
    counters.packets_resent = info("n_resent_packets");
    counters.packets_duplicated = info("n_duplicated_packets");
    counters.packets_unbuffered = info("n_underruns");
    counters.resend_requests = info("n_resend_requests");
  }
  return counters;
}

}  // namespace forgescan
