// Goes through a log and hands over what is in it in the form people can use.
#pragma once

#include <nlohmann/json.hpp>

#include "fsmsg/cloud_slice_t.hpp"
#include "fsmsg/frame_t.hpp"
#include "services/common/geometry/point_cloud.h"
#include "tools/forgescan/log/recording.h"

namespace forgescan {

struct LogEvent {
  const std::string& channel;
  std::int64_t utime;      // us since 1970 UTC, of recording
  std::uint32_t sequence;  // of the event in the log, wrapping
};

// Any error ends the visit.
class LogVisitor {
 public:
  virtual ~LogVisitor() = default;
  virtual Status Image(const LogEvent& event, const fsmsg::frame_t& frame, const std::string& png) = 0;
  // `slice` is the one that completed the cloud; it says which.
  virtual Status Cloud(const LogEvent& event, const fsmsg::cloud_slice_t& slice, const PointCloud& cloud) = 0;
  virtual Status Message(const LogEvent& event, const LcmStruct& type,
                         const nlohmann::ordered_json& message) = 0;
  // Of a type without definition.
  virtual Status Unknown(const LogEvent& event, ByteView message) = 0;
};

struct VisitedKinds {
  bool images = true, clouds = true, messages = true;
};

// Messages that are damaged, images that no PNG can hold, and clouds that lack slices, are named on standard
// error and counted: that is the result. Memory: one message, and at most 8 clouds a channel. Errors: kIo,
// the visitor's.
Result<std::int64_t> VisitLog(const Recording& recording, VisitedKinds kinds, LogVisitor& visitor);

// The outcome of an export after which `problems` things are missing. Errors: kUntrusted (some, or the log is
// damaged).
Status CheckExport(const Recording& recording, std::int64_t problems);

// One line of JSON; arrays of bytes become base64, text that is not UTF-8 is mended.
std::string JsonText(nlohmann::ordered_json json);
// What a message of an unknown type becomes.
nlohmann::ordered_json UnknownToJson(ByteView message);

}  // namespace forgescan
