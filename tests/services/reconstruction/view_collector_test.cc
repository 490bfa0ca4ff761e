#include "services/reconstruction/view_collector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace forgescan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using State = ViewCollector::State;
constexpr std::int8_t kLeft = fsmsg::exposure_t::CAMERA_LEFT, kRight = fsmsg::exposure_t::CAMERA_RIGHT;

fsmsg::frame_t Frame(std::int8_t camera, int pattern, int attempt = 0) {
  fsmsg::frame_t frame{};
  frame.utime = 1000 + pattern * 10 + camera;
  frame.camera = camera;
  frame.pattern = pattern;
  frame.attempt = attempt;
  frame.width_px = 2;
  frame.height_px = 1;
  frame.size = 2;
  frame.data = {1, 2};
  return frame;
}

fsmsg::view_frames_t Manifest(std::int8_t camera, int sent, int missing = 0, int attempt = 0) {
  fsmsg::view_frames_t manifest{};
  manifest.camera = camera;
  manifest.attempt = attempt;
  manifest.frames_expected = sent + missing;
  manifest.frames_sent = sent;
  manifest.frames_missing = missing;
  manifest.reason = missing > 0 ? "pulse 3 brought no image" : "";
  return manifest;
}

TEST(ViewCollector, Starts) { EXPECT_EQ(ViewCollector(2).state(), State::kCollecting); }

TEST(ViewCollector, CompleteInAnyOrderAndFramesComeOutSorted) {
  ViewCollector view(2);
  view.OnManifest(Manifest(kRight, 2));
  view.OnFrame(Frame(kRight, 1));
  view.OnFrame(Frame(kLeft, 1));
  view.OnManifest(Manifest(kLeft, 2));
  view.OnFrame(Frame(kLeft, 0));
  EXPECT_EQ(view.state(), State::kCollecting);
  view.OnFrame(Frame(kRight, 0));
  EXPECT_EQ(view.state(), State::kComplete);
  const auto frames = view.Frames(kLeft);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0]->pattern, 0);
  EXPECT_EQ(frames[1]->pattern, 1);
  EXPECT_EQ(view.middle_utime(), 1001 + (1012 - 1001) / 2);
}

TEST(ViewCollector, AMissingFrameMakesItVoidWithTheCamerasReason) {
  ViewCollector view(2);
  view.OnManifest(Manifest(kLeft, 1, 1));
  EXPECT_EQ(view.state(), State::kVoid);
  EXPECT_THAT(view.void_reason(), HasSubstr("pulse 3"));
}

TEST(ViewCollector, AVoidCaptureIsVoidAtOnce) {
  ViewCollector view(2);
  fsmsg::view_captured_t captured{};
  captured.status = fsmsg::view_captured_t::STATUS_VOID;
  captured.reason = "the robot left its position";
  view.OnCaptured(captured);
  EXPECT_EQ(view.void_reason(), "the robot left its position");
}

TEST(ViewCollector, ANewAttemptStartsAfresh) {
  ViewCollector view(1);
  view.OnManifest(Manifest(kLeft, 0, 1));
  EXPECT_EQ(view.state(), State::kVoid);
  view.OnFrame(Frame(kLeft, 0, 1));
  EXPECT_EQ(view.state(), State::kCollecting);
  view.OnFrame(Frame(kRight, 0, 0));  // of the old attempt
  EXPECT_EQ(view.frames_received(), 1);
}

TEST(ViewCollector, ContradictionsMakeItVoid) {
  for (const auto& spoil : std::vector<std::function<void(fsmsg::frame_t&)>>{
           [](auto& f) { f.pattern = 2; }, [](auto& f) { f.pattern = -1; }, [](auto& f) { f.width_px = 3; },
           [](auto& f) { f.height_px = -1; }, [](auto& f) { f.data.clear(); }}) {
    ViewCollector view(2);
    auto frame = Frame(kLeft, 0);
    spoil(frame);
    view.OnFrame(frame);
    EXPECT_EQ(view.state(), State::kVoid);
  }
  ViewCollector view(2);
  view.OnManifest(Manifest(kLeft, 3));
  EXPECT_THAT(view.void_reason(), AllOf(HasSubstr("3 patterns"), HasSubstr("2 frames")));
}

TEST(ViewCollector, AnUnknownCameraIsLeftOut) {
  ViewCollector view(2);
  view.OnFrame(Frame(7, 0));
  EXPECT_EQ(view.frames_received(), 0);
  EXPECT_EQ(view.state(), State::kCollecting);
}

TEST(ViewCollector, ExpiryDoesNotTouchACompleteView) {
  ViewCollector view(1);
  for (const std::int8_t camera : {kLeft, kRight}) {
    view.OnFrame(Frame(camera, 0));
    view.OnManifest(Manifest(camera, 1));
  }
  view.Expire("too late");
  EXPECT_EQ(view.state(), State::kComplete);
  ViewCollector open(1);
  open.Expire("too late");
  EXPECT_EQ(open.void_reason(), "too late");
}

}  // namespace
}  // namespace forgescan
