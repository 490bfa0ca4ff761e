// Sensor: turns trigger edges into exposed frames, in order, each at the end of its exposure.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <vector>

#include "tools/virtual_station/gige/gige_device.h"
#include "tools/virtual_station/gige/gvsp.h"
#include "tools/virtual_station/gige/registers.h"

namespace forgescan::gige {

class Sensor {
 public:
  using ImageSource = std::function<std::shared_ptr<const std::vector<std::uint8_t>>(std::uint64_t tag)>;
  using Sink = std::function<bool(std::shared_ptr<const GvspFrame>)>;  // false: no room

  struct Options {
    std::uint32_t width_px = 0, height_px = 0;  // of the images the source gives
    std::uint16_t first_block_id = 1;
    std::uint64_t seed = 1;
    ImageSource image;
    Sink sink;
  };

  Sensor(const RegisterFile& registers, Options options);
  ~Sensor();

  void Edge(std::int64_t t_mono_ns, std::uint64_t tag);
  // A new acquisition: ids start again, exposures under way are abandoned.
  void Restart();
  void SetFaults(double lost_trigger_chance, double dropped_frame_chance);
  // Only the edge and frame counters are set, but for frames_sent.
  GigeCounters counters() const;

 private:
  struct Exposure {
    std::int64_t t_mono_ns;
    std::uint64_t tag;
    std::uint64_t frame_number;  // 1, 2, 3, ... without wrap
    std::uint16_t block_id;
    bool dropped;
    AcquisitionSettings settings;
  };

  void Run();
  std::shared_ptr<const GvspFrame> MakeFrame(const Exposure& exposure) const;
  bool Happens(double chance);

  const RegisterFile& registers_;
  const Options options_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::deque<Exposure> exposures_;
  std::int64_t exposing_until_ns_ = 0;
  std::uint64_t next_frame_number_ = 1;
  std::uint64_t acquisition_ = 0;
  double lost_trigger_chance_ = 0;
  double dropped_frame_chance_ = 0;
  std::mt19937_64 random_;
  GigeCounters counters_;
  std::thread thread_;
};

}  // namespace forgescan::gige
