// GigeDevice: a GigE Vision camera in software, on a real UDP port, fired by edges of a simulated trigger
// controller.
//
// A client (the production driver, any viewer) cannot tell it from hardware: discovery, control with
// heartbeat, registers with a GenICam description, hardware line, packet resend, test packet, packet delay,
// chunks, and the pace of its network link.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/common/result.h"
#include "tools/virtual_station/gige/link.h"

namespace forgescan {

// Chances are 0..1, per packet or per edge; equal seeds give equal sequences of draws.
struct GigeFaults {
  double packet_loss_chance = 0;    // of resent packets too
  double lost_trigger_chance = 0;   // the edge does not reach the sensor: no frame, no id used
  double dropped_frame_chance = 0;  // exposed and thrown away: id used, nothing sent
  bool resend_unavailable = false;  // resend requests are answered with "unavailable"
  bool control_silent = false;      // answers no command: the client's heartbeat is lost
};

struct GigeDeviceConfig {
  std::string address = "127.0.0.1";  // one device per address; any of 127.0.0.0/8 works without setup
  std::uint64_t mac = 0x02'00'00'00'00'01;
  std::string vendor = "forgescan", model = "virtual", serial = "1", user_name = "camera";
  int width_px = 2448;  // of the sensor, multiples of 4
  int height_px = 2048;
  double rate_mbit_s = 1000;   // of the camera's network port; <= 0: no pacing
  std::shared_ptr<Link> link;  // the link into the host, if cameras share one
  bool offers_resend = true;
  std::uint64_t seed = 1;
  std::uint16_t first_block_id = 1;  // at each start of acquisition; near 65535 to see the wrap
  // The image of an exposure: width_px * height_px bytes. Called on the sensor thread at the end of exposure,
  // off the trigger thread, one call at a time; an image that is not ready or has another size is counted and
  // not sent.
  std::function<std::shared_ptr<const std::vector<std::uint8_t>>(std::uint64_t tag)> image;
};

struct GigeCounters {
  std::uint64_t edges = 0;          // all calls of Edge()
  std::uint64_t edges_unarmed = 0;  // not acquiring, or not triggered by Line0
  std::uint64_t edges_while_exposing = 0;
  std::uint64_t edges_lost = 0;      // by the fault knob
  std::uint64_t frames_exposed = 0;  // a block id was used
  std::uint64_t frames_dropped = 0;  // by the fault knob
  std::uint64_t frames_overrun = 0;  // the camera's memory was full
  std::uint64_t image_errors = 0;
  std::uint64_t frames_sent = 0;
  std::uint64_t packets_sent = 0, packets_lost = 0, packets_refused = 0, packets_failed = 0;
  std::uint64_t resends = 0, resends_unavailable = 0;  // packets
  std::uint64_t commands = 0, commands_malformed = 0, commands_refused = 0, heartbeats_expired = 0;
};

// Thread-safe; all work is done on three threads of its own (control, sensor, transmission).
class GigeDevice {
 public:
  // Errors: kInvalidArgument (config), kIo (address or port taken).
  static Result<std::unique_ptr<GigeDevice>> Create(GigeDeviceConfig config);
  ~GigeDevice();
  GigeDevice(const GigeDevice&) = delete;
  GigeDevice& operator=(const GigeDevice&) = delete;

  // A rising edge on Line0 at t (CLOCK_MONOTONIC, now or a little before). Never blocks for long. The frame's
  // timestamp is t; it is sent from t + exposure on. An edge during an exposure or when not armed yields no
  // frame.
  void Edge(std::int64_t t_mono_ns, std::uint64_t tag);

  void SetFaults(const GigeFaults& faults);
  // Forgets settings, control and frames, and is silent for a while, as after a power cut.
  void Reboot(std::int64_t duration_ms);

  // Whether a client has armed it: edges now yield frames.
  bool armed() const;
  GigeCounters counters() const;

 private:
  class Impl;
  explicit GigeDevice(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace forgescan
