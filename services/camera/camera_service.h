// The camera service: every image of one camera as a message, paired with the pulse that exposed it.
#pragma once

#include <map>
#include <string>

#include "drivers/camera/camera.h"
#include "fsmsg/exposure_t.hpp"
#include "fsmsg/frame_t.hpp"
#include "services/camera/camera_config.h"
#include "services/camera/frame_pairing.h"
#include "services/camera/view_book.h"
#include "services/common/service/service_monitor.h"

namespace forgescan {

class CameraService {
 public:
  // side: exposure_t.CAMERA_LEFT or CAMERA_RIGHT. Tries to start the camera again and again until it answers.
  CameraService(StreamHub& hub, ServiceMonitor& monitor, Camera& camera, CameraConfig config,
                std::int8_t side);
  ~CameraService();

 private:
  void StartCamera();
  void OnExposure(const fsmsg::exposure_t& exposure);
  void OnCaptured(const fsmsg::view_captured_t& captured);
  void OnFrame(CameraFrame frame);
  void Carry(const std::vector<PairingAction>& actions);
  void CarryOne(const PairingAction& action);
  void GiveUp(const fsmsg::exposure_t& exposure, const std::string& what);
  // Why the image does not show what was ordered; empty = it does.
  std::string WrongExposure(const fsmsg::exposure_t& exposure, const CameraFrame& frame) const;
  void PublishFrame(const fsmsg::exposure_t& exposure, const CameraFrame& frame);
  void PublishClosedViews();
  void CountCamera();

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  Camera& camera_;
  CameraConfig config_;
  std::int8_t side_;
  Channel<fsmsg::frame_t> frame_channel_;
  Channel<fsmsg::view_frames_t> manifest_channel_;
  FramePairing pairing_;
  ViewBook book_;
  std::map<std::uint64_t, fsmsg::exposure_t> exposures_;  // by order of arrival, the newest
  std::map<std::uint64_t, CameraFrame> frames_;           // by handle: waiting for their pulse
  std::uint64_t next_record_ = 1;
  std::uint64_t next_handle_ = 1;
  Bus::TimerId timer_ = 0;
};

}  // namespace forgescan
