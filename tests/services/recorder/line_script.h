// Says what a line says of a part, on every stream, and keeps book of it.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "services/common/bus/channels.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan::testing {

struct Said {
  std::string channel;
  std::int64_t session = 0;
  std::int64_t sequence = 0;
  int part = 0;
  std::int64_t utime = 0;  // when
};

class LineScript {
 public:
  LineScript(StreamHub& hub, std::size_t frame_bytes) : hub_(hub), frame_bytes_(frame_bytes) {
    AdvertiseAll();
  }

  const std::vector<Said>& said() const { return said_; }
  std::size_t SaidOf(int part) const {
    std::size_t count = 0;
    for (const Said& one : said_) {
      count += one.part == part ? 1 : 0;
    }
    return count;
  }
  // The whole story of a part; `pause` runs between its messages.
  void Part(int part, int views, const std::function<void()>& pause, std::int8_t verdict = 1) {
    Begin(part, pause);
    for (int view = 0; view < views; ++view) {
      View(part, view, pause);
    }
    End(part, pause, verdict);
  }
  void Begin(int part, const std::function<void()>& pause) {
    Say(kPartArrived, Of<fsmsg::part_arrived_t>(part), pause);
  }
  void View(int part, int view, const std::function<void()>& pause) {
    Say(kViewReady, Of<fsmsg::view_ready_t>(part, view), pause);
    for (int pulse = 0; pulse < 2; ++pulse) {
      Say(kExposure, Of<fsmsg::exposure_t>(part, view), pause);
      Say(kFrameLeft, Frame(part, view), pause);
      Say(kFrameRight, Frame(part, view), pause);
    }
    Say(kViewCaptured, Of<fsmsg::view_captured_t>(part, view), pause);
    Say(kViewFramesLeft, Of<fsmsg::view_frames_t>(part, view), pause);
    Say(kViewFramesRight, Of<fsmsg::view_frames_t>(part, view), pause);
    Say(kPartTemperature, Of<fsmsg::part_temperature_t>(part, view), pause);
    Say(kViewCloud, Of<fsmsg::cloud_slice_t>(part, view), pause);
    Say(kViewResult, Of<fsmsg::view_result_t>(part, view), pause);
    Say(kReconstructionTime, Of<fsmsg::processing_time_t>(part, view), pause);
  }
  void End(int part, const std::function<void()>& pause, std::int8_t verdict) {
    Say(kScanComplete, Of<fsmsg::scan_complete_t>(part), pause);
    Say(kFusedCloud, Of<fsmsg::cloud_slice_t>(part, -1), pause);
    Say(kFusionResult, Of<fsmsg::fusion_result_t>(part), pause);
    Say(kFusionTime, Of<fsmsg::processing_time_t>(part, -1), pause);
    Say(kRegisteredCloud, Of<fsmsg::cloud_slice_t>(part, -1), pause);
    Say(kRegistration, Of<fsmsg::registration_t>(part), pause);
    Say(kRegistrationTime, Of<fsmsg::processing_time_t>(part, -1), pause);
    auto judged = Of<fsmsg::verdict_t>(part);
    judged.verdict = verdict;
    Say(kVerdict, judged, pause);
    auto sorted = Of<fsmsg::part_sorted_t>(part);
    sorted.verdict = verdict;
    Say(kPartSorted, sorted, pause);
  }

 private:
  template <typename Message>
  Message Of(int part) const {
    Message message{};
    message.utime = hub_.bus().NowUs();
    message.part = part;
    return message;
  }
  template <typename Message>
  Message Of(int part, int view) const {
    auto message = Of<Message>(part);
    message.view = view;
    return message;
  }
  fsmsg::frame_t Frame(int part, int view) const {
    auto frame = Of<fsmsg::frame_t>(part, view);
    frame.data.assign(frame_bytes_, static_cast<std::uint8_t>(said_.size()));
    frame.size = static_cast<std::int32_t>(frame.data.size());
    return frame;
  }
  template <typename Message>
  void Say(const Channel<Message>& channel, const Message& message, const std::function<void()>& pause) {
    ASSERT_TRUE(hub_.Publish(channel, message).ok());
    said_.push_back({channel.name, hub_.session(), ++sequence_[channel.name], message.part, message.utime});
    pause();
  }
  template <typename... Channels>
  void Advertise(const Channels&... channels) {
    (hub_.Advertise(channels), ...);
  }
  void AdvertiseAll() {
    Advertise(kPartArrived, kViewReady, kExposure, kViewCaptured, kFrameLeft, kFrameRight, kViewFramesLeft,
              kViewFramesRight, kPartTemperature, kScanComplete, kViewCloud, kViewResult, kFusedCloud,
              kFusionResult, kRegisteredCloud, kRegistration, kVerdict, kPartSorted, kReconstructionTime,
              kFusionTime, kRegistrationTime);
  }

  StreamHub& hub_;
  std::size_t frame_bytes_;
  std::map<std::string, std::int64_t> sequence_;
  std::vector<Said> said_;
};

}  // namespace forgescan::testing
