#include "tools/forgescan/standing/empty_scans.h"

#include <limits>
#include <map>

#include "services/common/bus/channels.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/codec.h"
#include "tools/forgescan/replay/recorded_session.h"

namespace forgescan {
namespace {

// The scans of one recording, by the number of the part and the view.
class ScanReader {
 public:
  ScanReader(std::string log, const StandingOrigin& origin) : log_(std::move(log)), origin_(origin) {}

  Result<std::vector<std::vector<ViewCloud>>> Run() {
    ASSIGN_OR_RETURN(const RecordedSession session, RecordedSession::Open({log_}));
    if (!session.findings().empty()) {
      return Fail(ErrorCode::kUntrusted, "{}: not whole: {}", log_, session.findings().front());
    }
    RETURN_IF_ERROR(CheckCalibration(session));
    for (const RecordedEvent& event : session.events()) {
      const std::string& channel = session.ChannelOf(event);
      if (channel == kPartArrived.name || channel == kPartTemperature.name || channel == kViewCloud.name) {
        ASSIGN_OR_RETURN(const Bytes message, session.Read(event));
        RETURN_IF_ERROR(Take(channel, message));
      }
    }
    std::vector<std::vector<ViewCloud>> scans;
    for (auto& [part, views] : scans_) {
      std::vector<ViewCloud>& scan = scans.emplace_back();
      for (auto& [view, cloud] : views) scan.push_back(std::move(cloud));
    }
    if (scans.empty()) {
      return Fail(ErrorCode::kNotFound, "{}: holds no points of a view", log_);
    }
    return scans;
  }

 private:
  Status CheckCalibration(const RecordedSession& session) const {
    for (const fsmsg::recorded_file_t& file : session.files()) {
      if (!file.name.starts_with("calibration")) continue;
      const auto crc32 = static_cast<std::uint32_t>(file.crc32);
      if (crc32 == origin_.calibration_crc32) return {};
      return Fail(ErrorCode::kInvalidArgument,
                  "{}: recorded with the calibration {:08x}, the station has {:08x}", log_, crc32,
                  origin_.calibration_crc32);
    }
    return Fail(ErrorCode::kNotFound, "{}: holds no calibration", log_);
  }

  Status Take(const std::string& channel, const Bytes& message) {
    if (channel == kPartArrived.name) {
      ASSIGN_OR_RETURN(const auto arrived, Decode<fsmsg::part_arrived_t>(message));
      const auto path_crc32 = static_cast<std::uint32_t>(arrived.path_crc32);
      if (path_crc32 != origin_.path_crc32) {
        return Fail(
            ErrorCode::kInvalidArgument,
            "{}: part {} was scanned on the robot's path {:08x}, the view matrices were taught on {:08x}",
            log_, arrived.part, path_crc32, origin_.path_crc32);
      }
      return {};
    }
    if (channel == kPartTemperature.name) {
      ASSIGN_OR_RETURN(const auto temperature, Decode<fsmsg::part_temperature_t>(message));
      if (temperature.valid == 1) {
        return Fail(ErrorCode::kUntrusted,
                    "{}: part {} view {}: the pyrometer saw {:.0f} degC: not a scan of the empty cell", log_,
                    temperature.part, temperature.view, temperature.temperature_degc);
      }
      return {};
    }
    ASSIGN_OR_RETURN(const auto slice, Decode<fsmsg::cloud_slice_t>(message));
    ASSIGN_OR_RETURN(auto cloud, assembler_.Add(slice));
    if (cloud.has_value()) {
      constexpr double kNone = std::numeric_limits<double>::quiet_NaN();  // an empty cell has no temperature
      scans_[slice.part][slice.view] = ViewCloud{slice.view, kNone, std::move(*cloud)};
    }
    return {};
  }

  std::string log_;
  StandingOrigin origin_;
  CloudAssembler assembler_;
  std::map<int, std::map<int, ViewCloud>> scans_;
};

}  // namespace

Result<std::vector<std::vector<ViewCloud>>> ReadEmptyScans(const std::vector<std::string>& logs,
                                                           const StandingOrigin& origin) {
  std::vector<std::vector<ViewCloud>> all;
  for (const std::string& log : logs) {
    ASSIGN_OR_RETURN(auto scans, ScanReader(log, origin).Run());
    std::move(scans.begin(), scans.end(), std::back_inserter(all));
  }
  return all;
}

}  // namespace forgescan
