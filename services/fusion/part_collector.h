// Collects what arrives about one part until every view is there or known to be void. Pure: no bus, no clock.
//
//            first news of the part                     scan complete, all views settled
//   (none) -------------------------> collecting ---------------------------------------> settled
//                                          | deadline after scan complete: open views become void
//                                          +-----------------------------------------------^
// Events may come in any order and more than once; a newer attempt at a view replaces an older one.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>

#include "fsmsg/fusion_result_t.hpp"
#include "fsmsg/part_arrived_t.hpp"
#include "fsmsg/part_temperature_t.hpp"
#include "fsmsg/scan_complete_t.hpp"
#include "fsmsg/view_result_t.hpp"
#include "services/common/geometry/point_cloud.h"
#include "services/fusion/fuse.h"

namespace forgescan {

class PartCollector {
 public:
  // us since 1970 UTC; what is older is of an earlier part with the number.
  void IgnoreBefore(std::int64_t utime) { ignore_before_utime_ = utime; }
  // Notes the time of an event of the part. False: the event is of an earlier part, and not to be handed
  // over.
  bool Admits(std::int64_t utime);
  // The arrival is not of this part but of a later one: this one has arrived already, or has older news.
  bool IsBefore(const fsmsg::part_arrived_t& arrived) const {
    return arrived_.has_value() || earliest_utime_ < arrived.utime;
  }

  void OnArrived(const fsmsg::part_arrived_t& arrived) { arrived_ = arrived; }
  void OnViewResult(const fsmsg::view_result_t& result);
  // utime: of the view the cloud shows. A cloud with another time than the view's result is not used.
  // taught_from_actual: the robot's error then, or why the view is void with this cloud.
  void OnCloud(int view, std::int64_t utime, PointCloud cloud,
               Result<Eigen::Isometry3d> taught_from_actual = Eigen::Isometry3d::Identity()) {
    views_[view].cloud = std::move(cloud);
    views_[view].cloud_utime = utime;
    views_[view].taught_from_actual = std::move(taught_from_actual);
  }
  void OnTemperature(const fsmsg::part_temperature_t& temperature) {
    views_[temperature.view].temperature = temperature;
  }
  // The view is void for this reason whatever comes of it.
  void SetViewVoid(int view, const std::string& reason) { views_[view].void_reason = reason; }
  void OnScanComplete(const fsmsg::scan_complete_t& scan) { scan_ = scan; }
  // Views still open become void for this reason.
  void Expire(const std::string& reason) { expired_ = reason; }

  const std::optional<fsmsg::part_arrived_t>& arrived() const { return arrived_; }
  const std::optional<fsmsg::scan_complete_t>& scan() const { return scan_; }
  // All views are settled: TakeViews() may be called.
  bool Settled() const;
  // The usable clouds move to `clouds`; the summary has one entry a view, void ones with their reason.
  struct Views {
    std::vector<ViewCloud> clouds;
    std::vector<fsmsg::fused_view_t> summary;
    std::int64_t scan_utime = 0;  // of the end of the scan
    int frames_expected = 0;
    int frames_used = 0;
  };
  Views TakeViews();

 private:
  struct View {
    std::optional<fsmsg::view_result_t> result;
    std::optional<PointCloud> cloud;
    std::int64_t cloud_utime = 0;
    Result<Eigen::Isometry3d> taught_from_actual = Eigen::Isometry3d::Identity();
    std::optional<fsmsg::part_temperature_t> temperature;
    std::optional<std::string> void_reason;
  };
  // Why the view is void; empty = it is usable; nothing = still open.
  std::optional<std::string> VoidReason(const View& view) const;
  bool AllCapturedHaveResults() const;

  std::int64_t ignore_before_utime_ = std::numeric_limits<std::int64_t>::min();
  std::int64_t earliest_utime_ = std::numeric_limits<std::int64_t>::max();
  std::optional<fsmsg::part_arrived_t> arrived_;
  std::optional<fsmsg::scan_complete_t> scan_;
  std::optional<std::string> expired_;
  std::map<int, View> views_;
};

}  // namespace forgescan
