// Collects the frames of one view from both cameras until it is complete or known to be void. Pure: no bus,
// no clock.
//
//              frames, manifests, "captured" in any order
//   collecting ------------------------------------------> complete   every frame of both cameras is there
//        |   void capture, frames missing, contradictions
//        +-----------------------------------------------> void       with the reason; also by Expire()
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fsmsg/exposure_t.hpp"
#include "fsmsg/frame_t.hpp"
#include "fsmsg/view_captured_t.hpp"
#include "fsmsg/view_frames_t.hpp"

namespace forgescan {

class ViewCollector {
 public:
  // frames_per_camera: length of the projected sequence.
  explicit ViewCollector(int frames_per_camera) : frames_per_camera_(frames_per_camera) {}

  void OnCaptured(const fsmsg::view_captured_t& captured);
  void OnManifest(const fsmsg::view_frames_t& manifest);
  void OnFrame(const fsmsg::frame_t& frame);
  // The view is void for this reason unless it is complete.
  void Expire(const std::string& reason);

  enum class State { kCollecting, kComplete, kVoid };
  State state() const;
  const std::string& void_reason() const { return void_reason_; }
  int frames_received() const;
  // us since 1970 UTC, middle of the view's exposures; of the newest event of the view without a frame.
  std::int64_t middle_utime() const;
  // us since 1970 UTC, of the newest event of the view; 0 without one.
  std::int64_t newest_utime() const { return newest_utime_; }
  // us since 1970 UTC, of the end of the capture; 0 until it is told.
  std::int64_t captured_utime() const { return captured_utime_; }
  int attempt() const { return attempt_; }
  // Frames of a camera (exposure_t.CAMERA_*) in the order of the projected sequence. Only when complete.
  std::vector<const fsmsg::frame_t*> Frames(int camera) const;

 private:
  struct Camera {
    std::map<int, fsmsg::frame_t> frames;  // by pattern
    std::optional<fsmsg::view_frames_t> manifest;
  };
  // True if the event belongs to the newest attempt, and notes its time; a newer attempt starts the
  // collection afresh.
  bool IsCurrent(int attempt, std::int64_t utime);
  Camera* CameraOf(int camera);
  void SetVoid(const std::string& reason);
  // fired: pulses of each camera as the trigger counts them.
  void CheckPatterns(int fired);

  int frames_per_camera_;
  int attempt_ = 0;
  std::int64_t newest_utime_ = 0;
  std::int64_t captured_utime_ = 0;
  std::array<Camera, 2> cameras_;  // left, right
  std::string void_reason_;
};

}  // namespace forgescan
