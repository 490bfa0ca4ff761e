#include "tools/forgescan/log/log_visitor.h"

#include <map>
#include <set>
#include <tuple>

#include "services/common/base64.h"
#include "services/common/bus/big_endian.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_header.h"
#include "services/common/log/lcm_decode.h"
#include "tools/forgescan/log/image_file.h"
#include "tools/forgescan/log/progress.h"
#include "tools/forgescan/log/shown_text.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

class Visit {
 public:
  Visit(const Recording& recording, VisitedKinds kinds, LogVisitor& visitor)
      : recording_(recording), kinds_(kinds), visitor_(visitor) {}

  Result<std::int64_t> Run() {
    const LogReader& log = recording_.log;
    Progress progress(log.file_bytes());
    for (const LogEntry& entry : log.entries()) {
      ASSIGN_OR_RETURN(const Bytes message, log.Read(entry));
      offset_ = entry.offset;
      RETURN_IF_ERROR(
          Hand({log.ChannelOf(entry), entry.utime, static_cast<std::uint32_t>(entry.number)}, message));
      progress.At(entry.offset);
    }
    for (const auto& [channel, part, view, utime] : open_clouds_) {
      Say(channel, fmt::format("the cloud of part {}, view {}, time {} lacks slices", part, view, utime));
    }
    return problems_;
  }

 private:
  Status Hand(const LogEvent& event, ByteView message) {
    const LcmStruct* type = recording_.types.TypeOf(message);
    if (type == nullptr) {
      return kinds_.messages ? visitor_.Unknown(event, message) : Status();
    }
    if (const auto header = type->IsStream() ? CheckStreamHeader(message) : StreamHeader(); !header.ok()) {
      return Problem(event.channel, header.error().message);
    }
    const auto fingerprint = BigEndianAt<std::int64_t>(message, 0);
    if (fingerprint == fsmsg::frame_t::getHash()) {
      return kinds_.images ? HandImage(event, message) : Status();
    }
    if (fingerprint == fsmsg::cloud_slice_t::getHash()) {
      return kinds_.clouds ? HandSlice(event, message) : Status();
    }
    if (!kinds_.messages) {
      return {};
    }
    const auto json = DecodeToJson(recording_.types, message);
    return json.ok() ? visitor_.Message(event, *type, *json) : Problem(event.channel, json.error().message);
  }

  Status HandImage(const LogEvent& event, ByteView message) {
    const auto frame = Decode<fsmsg::frame_t>(message);
    if (!frame.ok()) {
      return Problem(event.channel, frame.error().message);
    }
    const std::int64_t pixels = std::int64_t{frame->width_px} * frame->height_px;
    if (frame->width_px < 1 || frame->height_px < 1 ||
        pixels != static_cast<std::int64_t>(frame->data.size())) {
      return Problem(event.channel, fmt::format("an image of {} x {} px has {} bytes", frame->width_px,
                                                frame->height_px, frame->data.size()));
    }
    const auto png = EncodePng(*frame);
    return png.ok() ? visitor_.Image(event, *frame, *png) : Problem(event.channel, png.error().message);
  }

  Status HandSlice(const LogEvent& event, ByteView message) {
    const auto slice = Decode<fsmsg::cloud_slice_t>(message);
    if (!slice.ok()) {
      return Problem(event.channel, slice.error().message);
    }
    const auto cloud = assemblers_[event.channel].Add(*slice);
    if (!cloud.ok()) {
      return Problem(event.channel, cloud.error().message);
    }
    const CloudKey key{event.channel, slice->part, slice->view, slice->utime};
    if (!cloud->has_value()) {
      open_clouds_.insert(key);
      return {};
    }
    open_clouds_.erase(key);
    return visitor_.Cloud(event, *slice, **cloud);
  }

  void Say(const std::string& channel, const std::string& problem) {
    ++problems_;
    fmt::print(stderr, "{}: byte {}: {}: {}\n", recording_.log.path(), offset_, channel, Shown(problem));
  }
  // Ok: the visit goes on.
  Status Problem(const std::string& channel, const std::string& problem) {
    Say(channel, problem);
    return {};
  }

  using CloudKey = std::tuple<std::string, std::int32_t, std::int32_t, std::int64_t>;  // part, view, utime

  const Recording& recording_;
  VisitedKinds kinds_;
  LogVisitor& visitor_;
  std::uint64_t offset_ = 0;
  std::int64_t problems_ = 0;
  std::map<std::string, CloudAssembler> assemblers_;  // by channel
  std::set<CloudKey> open_clouds_;
};

void ReplaceBytes(Json& json) {
  if (json.is_binary()) {
    json = Base64(json.get_binary());
  } else if (json.is_structured()) {
    for (Json& value : json) {
      ReplaceBytes(value);
    }
  }
}

}  // namespace

Result<std::int64_t> VisitLog(const Recording& recording, VisitedKinds kinds, LogVisitor& visitor) {
  return Visit(recording, kinds, visitor).Run();
}

Status CheckExport(const Recording& recording, std::int64_t problems) {
  const std::size_t stretches = recording.log.damage().size();
  if (problems == 0 && stretches == 0) {
    return {};
  }
  return Fail(ErrorCode::kUntrusted,
              "{}: what is intact was exported; left out: {} messages or clouds, {} damaged stretches",
              recording.log.path(), problems, stretches);
}

std::string JsonText(Json json) {
  ReplaceBytes(json);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json UnknownToJson(ByteView message) {
  const bool has_fingerprint = message.size() >= sizeof(std::uint64_t);
  const Json fingerprint =
      has_fingerprint ? Json(fmt::format("{:016x}", BigEndianAt<std::uint64_t>(message, 0))) : Json();
  return {{"fingerprint", fingerprint}, {"data", Base64(message)}};
}

}  // namespace forgescan
