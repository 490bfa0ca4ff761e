#include "tools/virtual_station/gige/sensor.h"

#include <algorithm>
#include <utility>

#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan::gige {
namespace {

constexpr std::uint64_t kBlockIds = 65535;  // 1..65535, 0 is skipped
constexpr std::size_t kMaxWaiting = 64;     // exposures whose image the source has not given yet

// The region of interest of a full image; the full image itself is not copied.
std::shared_ptr<const std::vector<std::uint8_t>> Crop(std::shared_ptr<const std::vector<std::uint8_t>> image,
                                                      const AcquisitionSettings& region,
                                                      std::uint32_t stride) {
  const std::size_t region_bytes = static_cast<std::size_t>(region.width_px) * region.height_px;
  if (region_bytes == image->size()) {
    return image;
  }
  auto cropped = std::make_shared<std::vector<std::uint8_t>>(region_bytes);
  for (std::size_t row = 0; row < region.height_px; ++row) {
    const auto from = image->begin() +
                      static_cast<std::ptrdiff_t>((row + region.offset_y_px) * stride + region.offset_x_px);
    std::copy_n(from, region.width_px, cropped->begin() + static_cast<std::ptrdiff_t>(row * region.width_px));
  }
  return cropped;
}

}  // namespace

Sensor::Sensor(const RegisterFile& registers, Options options)
    : registers_(registers),
      options_(std::move(options)),
      random_(options_.seed),
      thread_([this] { Run(); }) {}

Sensor::~Sensor() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Sensor::Edge(std::int64_t t_mono_ns, std::uint64_t tag) {
  const AcquisitionSettings settings = registers_.settings();
  {
    const std::lock_guard lock(mutex_);
    ++counters_.edges;
    // Both draws are made at every edge, so that one fault's chance does not move the other.
    const bool lost = Happens(lost_trigger_chance_);
    const bool dropped = Happens(dropped_frame_chance_);
    if (!settings.acquiring || !settings.line_triggered) {
      ++counters_.edges_unarmed;
      return;
    }
    if (lost) {
      ++counters_.edges_lost;
      return;
    }
    if (t_mono_ns < exposing_until_ns_) {
      ++counters_.edges_while_exposing;
      return;
    }
    exposing_until_ns_ = t_mono_ns + settings.exposure_us * 1000;
    const std::uint64_t number = next_frame_number_++;
    const auto block_id =
        static_cast<std::uint16_t>((options_.first_block_id - 1 + number - 1) % kBlockIds + 1);
    ++counters_.frames_exposed;
    if (exposures_.size() >= kMaxWaiting) {
      ++counters_.frames_overrun;
      return;
    }
    exposures_.push_back({t_mono_ns, tag, number, block_id, dropped, settings});
  }
  wake_.notify_one();
}

void Sensor::Restart() {
  const std::lock_guard lock(mutex_);
  exposures_.clear();
  exposing_until_ns_ = 0;
  next_frame_number_ = 1;
  ++acquisition_;
}

void Sensor::SetFaults(double lost_trigger_chance, double dropped_frame_chance) {
  const std::lock_guard lock(mutex_);
  lost_trigger_chance_ = lost_trigger_chance;
  dropped_frame_chance_ = dropped_frame_chance;
}

GigeCounters Sensor::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void Sensor::Run() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    if (exposures_.empty()) {
      wake_.wait(lock);
      continue;
    }
    const std::int64_t end_ns = exposures_.front().t_mono_ns + exposures_.front().settings.exposure_us * 1000;
    if (MonoNowNs() < end_ns) {
      wake_.wait_until(lock, MonoTimePoint(end_ns));
      continue;
    }
    const Exposure exposure = std::move(exposures_.front());
    exposures_.pop_front();
    const std::uint64_t acquisition = acquisition_;
    if (exposure.dropped) {
      ++counters_.frames_dropped;
      continue;
    }
    lock.unlock();  // the source may render for long
    const auto frame = MakeFrame(exposure);
    lock.lock();
    if (!frame) {
      ++counters_.image_errors;
    } else if (acquisition == acquisition_ && !options_.sink(frame)) {
      ++counters_.frames_overrun;
    }
  }
}

// Null if the source gives no image, or one of another size.
std::shared_ptr<const GvspFrame> Sensor::MakeFrame(const Exposure& exposure) const {
  auto image = options_.image(exposure.tag);
  const AcquisitionSettings& settings = exposure.settings;
  if (!image || image->size() != static_cast<std::size_t>(options_.width_px) * options_.height_px) {
    return nullptr;
  }
  auto frame = std::make_shared<GvspFrame>();
  frame->block_id = exposure.block_id;
  frame->timestamp_ns = static_cast<std::uint64_t>(exposure.t_mono_ns);
  frame->ready_ns = exposure.t_mono_ns + settings.exposure_us * 1000;
  frame->width_px = settings.width_px;
  frame->height_px = settings.height_px;
  frame->image = Crop(std::move(image), settings, options_.width_px);
  frame->chunks =
      MakeChunks(settings.chunks, {static_cast<std::uint32_t>(frame->image->size()), exposure.frame_number,
                                   frame->timestamp_ns, static_cast<std::uint64_t>(settings.exposure_us)});
  frame->packet_size_bytes = settings.packet_size_bytes;
  frame->packet_delay_ns = settings.packet_delay_ns;
  frame->target = settings.target;
  return frame;
}

bool Sensor::Happens(double chance) { return static_cast<double>(random_() >> 11) * 0x1p-53 < chance; }

}  // namespace forgescan::gige
