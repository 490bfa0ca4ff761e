// The reconstruction service: frames of a view in, its points or the reason why there are none out.
#pragma once

#include <memory>
#include <utility>

#include "fsmsg/part_arrived_t.hpp"
#include "fsmsg/view_result_t.hpp"
#include "services/common/aged_map.h"
#include "services/common/config/config.h"
#include "services/common/service/service_monitor.h"
#include "services/reconstruction/reconstruct.h"
#include "services/reconstruction/view_collector.h"

namespace forgescan {

// What the service adds to the thresholds of the reconstruction itself: table [reconstruction] of
// station.toml.
struct ReconstructionServiceConfig {
  ReconstructionConfig reconstruction;
  int publish_every_nth_point = 8;  // in scanner order; the fits need far fewer points than there are pixels
  double frame_timeout_s = 30.0;    // from the end of a view's exposures to its last frame

  static Result<ReconstructionServiceConfig> Load(ConfigTable table);
};

class ReconstructionService {
 public:
  ReconstructionService(StreamHub& hub, ServiceMonitor& monitor, const ReconstructionServiceConfig& config,
                        PatternSet pattern, StereoCalibration calibration);

 private:
  using Key = std::pair<int, int>;  // part, view

  // A view that has its result. What still comes of it must not begin it again.
  struct Finished {
    int attempt = 0;
    std::int64_t utime = 0;  // of its newest event
  };

  // The view a message belongs to; nothing if that view is finished, or is an earlier part's.
  template <typename Message>
  ViewCollector* View(const Message& message);
  // Drops what is left of an earlier part with the number.
  void OnArrived(const fsmsg::part_arrived_t& arrived);
  // Drops a view that never finished: another with its numbers has come.
  void Drop(Key key);
  bool IsFinished(Key key, int attempt, std::int64_t utime);
  void OnCaptured(const fsmsg::view_captured_t& captured);
  void FinishIfSettled(Key key);
  void Finish(Key key, const ViewCollector& view);
  Result<Reconstruction> Run(const ViewCollector& view);
  Status Publish(const fsmsg::view_result_t& result, const PointCloud& cloud);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  ReconstructionServiceConfig config_;
  PatternSet pattern_;
  StereoCalibration calibration_;
  std::unique_ptr<Reconstructor> reconstructor_;  // made with the first view, when the image size is known
  ImageSize image_size_{};                        // for which it was made
  AgedMap<Key, ViewCollector> views_;             // in work
  AgedMap<Key, Finished> finished_;
  AgedMap<int, std::int64_t> arrived_;  // utime of the last arrival of a part's number
};

}  // namespace forgescan
