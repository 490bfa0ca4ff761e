#include "tools/forgescan/replay/replay_network.h"

#include <filesystem>

#include "services/common/bus/channel_list.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/stream_header.h"
#include "tools/forgescan/replay/scratch_folder.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

// Holds what is in a folder, to put it back.
class KeptFolder {
 public:
  static Result<KeptFolder> Keep(const fs::path& folder) {
    ASSIGN_OR_RETURN(ScratchFolder scratch, ScratchFolder::Make());
    KeptFolder kept(folder, std::move(scratch));
    RETURN_IF_ERROR(Copy(folder, kept.scratch_.path()));
    return kept;
  }
  Status PutBack() const {
    std::error_code problem;
    fs::remove_all(folder_, problem);
    return problem ? Fail(ErrorCode::kIo, "{} cannot be put back: {}", folder_.string(), problem.message())
                   : Copy(scratch_.path(), folder_);
  }

 private:
  KeptFolder(fs::path folder, ScratchFolder scratch)
      : folder_(std::move(folder)), scratch_(std::move(scratch)) {}
  static Status Copy(const fs::path& from, const fs::path& to) {
    std::error_code problem;
    fs::copy(from, to, fs::copy_options::recursive, problem);
    return problem ? Fail(ErrorCode::kIo, "{} cannot be copied to {}: {}", from.string(), to.string(),
                          problem.message())
                   : Status();
  }

  fs::path folder_;
  ScratchFolder scratch_;
};

}  // namespace

// The service with its place on the network. Members end in reverse order.
struct ReplayNetwork::Host {
  Host(SimNetwork& network, const std::string& name, const std::string& config_hash)
      : bus(network.AddNode()), hub(bus, name), monitor(hub, name, config_hash) {}

  // Refuses what the killed service did not come to say, and all that follows it.
  void LiveAs(const RecordedLife& life, const std::set<std::string, std::less<>>& streams) {
    bus.SetSendFilter(
        [this, streams, last_utime = life.last_utime](std::string_view channel, ByteView message) {
          if (const auto utime = StreamUtime(message); streams.contains(channel) && utime.ok()) {
            const auto last = last_utime.find(channel);
            killed = killed || last == last_utime.end() || *utime > last->second;
          }
          return !killed;
        });
  }
  void Silence() {
    bus.SetSendFilter([](std::string_view, ByteView) { return false; });
  }

  bool dying = false;   // in the record it may be dead by now
  bool killed = false;  // it was dead when it would have said what it says here
  SimBus& bus;
  StreamHub hub;
  ServiceMonitor monitor;
  std::shared_ptr<void> service;
};

ReplayNetwork::ReplayNetwork(const Station& station, ReplayableService service, std::int64_t start_us,
                             ResultHandler on_result)
    : network_(1, start_us),
      recording_(network_.AddNode()),
      station_(station),
      service_(std::move(service)),
      session_(start_us) {
  network_.SetFaults({.latency_us = 0});
  own_.insert(service_.results.begin(), service_.results.end());
  own_.insert(service_.durations.begin(), service_.durations.end());
  for (const std::string channel : service_.results) {
    recording_.Subscribe(channel, [on_result, channel](ByteView message) { on_result(channel, message); });
  }
}

ReplayNetwork::~ReplayNetwork() = default;

Status ReplayNetwork::Begin(const RecordedLife& life, std::int64_t utime) {
  network_.RunUntil(utime);
  auto host = std::make_unique<Host>(network_, service_.name, station_.file.hash());
  if (life.how == RecordedLife::End::kKilled) {
    host->LiveAs(life, own_);
  }
  ASSIGN_OR_RETURN(host->service, service_.make({station_, host->hub, host->monitor}));
  host_ = std::move(host);
  return {};
}

void ReplayNetwork::NoteLastWord() {
  if (host_ != nullptr) {
    host_->dying = true;
  }
}

Status ReplayNetwork::End(RecordedLife::End how, std::int64_t utime) {
  network_.RunUntil(utime);
  if (host_ == nullptr) {
    return {};
  }
  if (how == RecordedLife::End::kStopped) {
    Remove();
    return {};
  }
  host_->Silence();
  if (!service_.keeps_files) {
    Remove();
    return {};
  }
  // Here it has an end; what it writes then, a killed process did not.
  ASSIGN_OR_RETURN(const KeptFolder kept, KeptFolder::Keep(station_.results));
  Remove();
  return kept.PutBack();
}

void ReplayNetwork::Remove() {
  SimBus& bus = host_->bus;
  host_.reset();
  network_.RemoveNode(bus);
  network_.RunFor(0);  // what it said last
}

Status ReplayNetwork::Feed(std::int64_t utime, const std::string& channel, Bytes message,
                           std::int64_t lost_before) {
  network_.RunUntil(utime);
  if (channel == kServiceState.name) {
    const auto state = Decode<fsmsg::service_state_t>(message);
    if (state.ok() && state->name == service_.name) {
      return {};  // here it speaks for itself
    }
  }
  if (!IsStateChannel(channel)) {
    std::int64_t& sequence = sequences_[channel];
    sequence += 1 + lost_before;
    RETURN_IF_ERROR(StampStreamHeader(message, {session_, sequence}));
  }
  if (host_ == nullptr || !host_->dying || !service_.keeps_files) {
    return Deliver(utime, channel, message);
  }
  ASSIGN_OR_RETURN(const KeptFolder kept, KeptFolder::Keep(station_.results));
  RETURN_IF_ERROR(Deliver(utime, channel, message));
  if (!host_->killed) {
    return {};
  }
  Remove();
  return kept.PutBack();
}

Status ReplayNetwork::Deliver(std::int64_t utime, const std::string& channel, ByteView message) {
  RETURN_IF_ERROR(recording_.Publish(channel, message));
  network_.RunUntil(utime);
  return {};
}

void ReplayNetwork::Finish() {
  if (host_ != nullptr) {
    host_->Silence();
    Remove();
  }
}

}  // namespace forgescan
