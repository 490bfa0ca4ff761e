#include "tools/forgescan/log/mcap_export.h"

#include <algorithm>
#include <map>
#include <utility>

#include "services/common/bus/channels.h"
#include "tools/forgescan/log/image_file.h"
#include "tools/forgescan/log/json_schema.h"
#include "tools/forgescan/log/log_visitor.h"
#include "tools/forgescan/log/mcap_writer.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

// Earlier than 1970 cannot be said in MCAP.
std::uint64_t Nanoseconds(std::int64_t utime) {
  constexpr std::int64_t kLatest = INT64_MAX / 1000;
  return static_cast<std::uint64_t>(std::clamp<std::int64_t>(utime, 0, kLatest)) * 1000;
}

// The frame of reference a cloud is in.
std::string FrameOf(const std::string& channel) {
  return channel == kViewCloud.name         ? "camera"
         : channel == kFusedCloud.name      ? "array"
         : channel == kRegisteredCloud.name ? "model"
                                            : channel;
}

class McapVisitor final : public LogVisitor {
 public:
  McapVisitor(const LcmTypes& types, McapWriter& writer) : types_(types), writer_(writer) {}

  Status Image(const LogEvent& event, const fsmsg::frame_t& frame, const std::string& png) override {
    ASSIGN_OR_RETURN(const std::uint16_t channel, Channel(event, "foxglove.CompressedImage", ImageSchema));
    return Put(event, channel, frame.utime,
               ImageMessage(frame.utime, "camera_" + CameraName(frame.camera), png));
  }
  Status Cloud(const LogEvent& event, const fsmsg::cloud_slice_t& slice, const PointCloud& cloud) override {
    ASSIGN_OR_RETURN(const std::uint16_t channel, Channel(event, "foxglove.PointCloud", CloudSchema));
    return Put(event, channel, slice.utime, CloudMessage(slice.utime, FrameOf(event.channel), cloud));
  }
  Status Message(const LogEvent& event, const LcmStruct& type, const Json& message) override {
    ASSIGN_OR_RETURN(const std::uint16_t channel,
                     Channel(event, type.name, [&] { return SchemaOf(types_, type); }));
    const auto utime = message.find("utime");
    const bool has_utime = utime != message.end() && utime->is_number_integer();
    return Put(event, channel, has_utime ? utime->get<std::int64_t>() : event.utime, message);
  }
  Status Unknown(const LogEvent& event, ByteView message) override {
    ASSIGN_OR_RETURN(const std::uint16_t channel, Channel(event, "lcm.unknown", UnknownSchema));
    return Put(event, channel, event.utime, UnknownToJson(message));
  }

  std::int64_t messages() const { return messages_; }

 private:
  // The number of the channel with this schema; both are made when they are first needed.
  template <typename MakeSchema>
  Result<std::uint16_t> Channel(const LogEvent& event, const std::string& schema, const MakeSchema& make) {
    const auto [channel, is_new] = channels_.try_emplace({event.channel, schema}, std::uint16_t{0});
    if (is_new) {
      if (!schemas_.contains(schema)) {
        ASSIGN_OR_RETURN(schemas_[schema], writer_.AddSchema(schema, make().dump()));
      }
      ASSIGN_OR_RETURN(channel->second, writer_.AddChannel(schemas_[schema], event.channel));
    }
    return channel->second;
  }
  Status Put(const LogEvent& event, std::uint16_t channel, std::int64_t utime, Json message) {
    ++messages_;
    return writer_.Write({channel, event.sequence, Nanoseconds(event.utime), Nanoseconds(utime)},
                         JsonText(std::move(message)));
  }

  const LcmTypes& types_;
  McapWriter& writer_;
  std::map<std::string, std::uint16_t> schemas_;                           // by name
  std::map<std::pair<std::string, std::string>, std::uint16_t> channels_;  // by channel and schema
  std::int64_t messages_ = 0;
};

}  // namespace

Status ExportMcap(const std::string& file, const std::string& mcap) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(file));
  ASSIGN_OR_RETURN(McapWriter writer, McapWriter::Create(mcap));
  McapVisitor visitor(recording.types, writer);
  ASSIGN_OR_RETURN(const std::int64_t problems, VisitLog(recording, {}, visitor));
  RETURN_IF_ERROR(writer.Close());
  fmt::print("{}: {} messages\n", mcap, visitor.messages());
  return CheckExport(recording, problems);
}

}  // namespace forgescan
