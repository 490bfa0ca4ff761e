// A small recording of one part, as the recorder writes it, for tests of the tools that read recordings.
#pragma once

#include <libdeflate.h>

#include <map>
#include <string>
#include <vector>

#include "fsmsg/cloud_slice_t.hpp"
#include "fsmsg/frame_t.hpp"
#include "fsmsg/recorded_file_t.hpp"
#include "fsmsg/recording_closed_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "fsmsg/service_state_t.hpp"
#include "fsmsg/verdict_t.hpp"
#include "services/common/bus/channels.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_header.h"
#include "services/common/log/channel_totals.h"
#include "services/common/log/log_writer.h"
#include "services/common/log/message_definitions.h"

namespace forgescan {

struct TestEvent {
  std::string channel;
  std::int64_t utime = 0;
  Bytes message;
};

inline constexpr std::int64_t kTestStartUs = 1'700'000'000'000'000;
inline constexpr int kTestPart = 7;
inline constexpr int kTestPixels = 24;  // on each side of an image

class TestRecording {
 public:
  std::vector<TestEvent> events;

  // Opening, one file of the station, 3 views with 2 images and a cloud each, states, a verdict, closing.
  static TestRecording Make() {
    TestRecording recording;
    recording.Open();
    for (int view = 0; view < 3; ++view) {
      recording.AddView(view);
    }
    fsmsg::verdict_t verdict{};
    verdict.utime = recording.Now();
    verdict.part = kTestPart;
    verdict.verdict = fsmsg::verdict_t::VERDICT_OK;
    recording.AddToStream(kVerdict.name, verdict);
    recording.Close({});
    return recording;
  }

  std::int64_t Now() const { return kTestStartUs + static_cast<std::int64_t>(events.size()) * 100'000; }
  template <typename Message>
  void Add(const char* channel, const Message& message) {
    events.push_back({channel, Now(), Encode(message)});
  }
  template <typename Message>
  void AddToStream(const char* channel, const Message& message) {
    Bytes bytes = Encode(message);
    EXPECT_TRUE(StampStreamHeader(bytes, {kTestStartUs, ++sequences_[channel]}).ok());
    events.push_back({channel, Now(), bytes});
  }
  // The closing event of what is there.
  void Close(const std::vector<fsmsg::recording_gap_t>& gaps,
             std::int8_t verdict = fsmsg::verdict_t::VERDICT_OK) {
    ChannelTotals totals;
    for (const TestEvent& event : events) {
      totals.Add(event.channel, event.message);
    }
    fsmsg::recording_closed_t closed{};
    closed.utime = Now();
    closed.part = kTestPart;
    closed.verdict = verdict;
    closed.reason = "the part was sorted";
    closed.channels = totals.Totals();
    closed.channel_count = static_cast<std::int32_t>(closed.channels.size());
    closed.gaps = gaps;
    closed.gap_count = static_cast<std::int32_t>(gaps.size());
    Add(kRecordingClosed.name, closed);
  }
  void WriteTo(const std::string& path) const {
    auto writer = LogWriter::Create(path);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    for (const TestEvent& event : events) {
      ASSERT_TRUE(writer->Write(event.channel, event.utime, event.message).ok());
    }
    ASSERT_TRUE(writer->Close().ok());
  }
  // Position of the n-th event of the channel.
  std::size_t Find(const std::string& channel, int n = 0) const {
    for (std::size_t i = 0; i < events.size(); ++i) {
      if (events[i].channel == channel && n-- == 0) return i;
    }
    ADD_FAILURE() << "no such event on " << channel;
    return 0;
  }

 private:
  void Open() {
    fsmsg::recording_opened_t opened{};
    opened.utime = Now();
    opened.part = kTestPart;
    opened.station = "test";
    opened.version = "1.2.3";
    opened.build = "g++";
    opened.file_count = 1;
    opened.types = AllMessageDefinitions();
    fsmsg::recorded_channel_t channel{};
    channel.channel = kVerdict.name;
    channel.type = "verdict_t";
    channel.fingerprint = fsmsg::verdict_t::getHash();
    opened.channels = {channel};
    opened.channel_count = 1;
    Add(kRecordingOpened.name, opened);
    fsmsg::recorded_file_t file{};
    file.utime = Now();
    file.name = "station.toml";
    file.data = {'a', ' ', '=', ' ', '1'};
    file.size = static_cast<std::int32_t>(file.data.size());
    file.crc32 = static_cast<std::int32_t>(libdeflate_crc32(0, file.data.data(), file.data.size()));
    Add(kRecordedFile.name, file);
  }
  void AddView(int view) {
    for (const int camera : {1, 2}) {
      fsmsg::frame_t frame{};
      frame.utime = Now();
      frame.part = kTestPart;
      frame.view = view;
      frame.camera = static_cast<std::int8_t>(camera);
      frame.pattern = view + 1;
      frame.width_px = frame.height_px = kTestPixels;
      for (int i = 0; i < kTestPixels * kTestPixels; ++i) {
        frame.data.push_back(static_cast<std::uint8_t>(i * 7 + view));
      }
      frame.size = static_cast<std::int32_t>(frame.data.size());
      AddToStream(camera == 1 ? kFrameLeft.name : kFrameRight.name, frame);
    }
    PointCloud cloud;
    for (int i = 0; i < 5; ++i) {
      cloud.points.emplace_back(static_cast<float>(i), static_cast<float>(view), 1000.F);
      cloud.normals.emplace_back(0.F, 0.F, -1.F);
      cloud.sigma_mm.push_back(0.01F);
      cloud.view.push_back(static_cast<std::uint16_t>(view));
    }
    const auto slices = SliceCloud(cloud, Now(), kTestPart, view);
    ASSERT_TRUE(slices.ok());
    AddToStream(kViewCloud.name, (*slices)[0]);
    fsmsg::service_state_t state{};
    state.utime = Now();
    state.name = "camera_left";
    state.last_error = "\xFF is not UTF-8";
    Add(kServiceState.name, state);
  }

  std::map<std::string, std::int64_t> sequences_;
};

}  // namespace forgescan
