#include "tools/forgescan/replay/replay_network.h"

#include <algorithm>
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

// A service with its place on the network. Members end in reverse order.
struct ReplayNetwork::Host {
  Host(SimNetwork& network, const ReplayableService& which, const std::string& config_hash)
      : known(which), bus(network.AddNode()), hub(bus, which.name), monitor(hub, which.name, config_hash) {}

  // Refuses what the killed service did not come to say, and all that follows it.
  void LiveAs(const RecordedLife& life) {
    std::set<std::string, std::less<>> streams(known.results.begin(), known.results.end());
    streams.insert(known.durations.begin(), known.durations.end());
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

  const ReplayableService& known;
  bool dying = false;   // in the record it may be dead by now
  bool killed = false;  // it was dead when it would have said what it says here
  SimBus& bus;
  StreamHub hub;
  ServiceMonitor monitor;
  std::shared_ptr<void> service;
};

ReplayNetwork::ReplayNetwork(const Station& station, std::vector<ReplayableService> services,
                             std::int64_t start_us, ResultHandler on_result)
    : network_(1, start_us),
      recording_(network_.AddNode()),
      station_(station),
      on_result_(std::move(on_result)),
      services_(std::move(services)),
      session_(start_us) {
  network_.SetFaults({.latency_us = 0});
  for (const ReplayableService& service : services_) {
    own_channels_.insert(service.results.begin(), service.results.end());
    own_channels_.insert(service.durations.begin(), service.durations.end());
    for (const std::string channel : service.results) {
      recording_.Subscribe(channel, [this, channel](ByteView message) { on_result_(channel, message); });
    }
  }
}

ReplayNetwork::~ReplayNetwork() = default;

const ReplayableService& ReplayNetwork::Known(const std::string& name) const {
  return *std::find_if(services_.begin(), services_.end(),
                       [&name](const auto& known) { return known.name == name; });
}

Status ReplayNetwork::Begin(const std::string& name, const RecordedLife& life, std::int64_t utime) {
  network_.RunUntil(utime);
  auto host = std::make_unique<Host>(network_, Known(name), station_.file.hash());
  if (life.how == RecordedLife::End::kKilled) {
    host->LiveAs(life);
  }
  ASSIGN_OR_RETURN(host->service, host->known.make({station_, host->hub, host->monitor}));
  hosts_[name] = std::move(host);
  return {};
}

void ReplayNetwork::NoteLastWord(const std::string& name) {
  if (const auto host = hosts_.find(name); host != hosts_.end()) {
    host->second->dying = true;
  }
}

Status ReplayNetwork::End(const std::string& name, RecordedLife::End how, std::int64_t utime) {
  network_.RunUntil(utime);
  const auto host = hosts_.find(name);
  if (host == hosts_.end()) {
    return {};
  }
  if (how == RecordedLife::End::kStopped) {
    Remove(name);
    return {};
  }
  host->second->Silence();
  if (!host->second->known.keeps_files) {
    Remove(name);
    return {};
  }
  // Here it has an end; what it writes then, a killed process did not.
  ASSIGN_OR_RETURN(const KeptFolder kept, KeptFolder::Keep(station_.results));
  Remove(name);
  return kept.PutBack();
}

void ReplayNetwork::Remove(const std::string& name) {
  const auto found = hosts_.find(name);
  SimBus& bus = found->second->bus;
  hosts_.erase(found);
  network_.RemoveNode(bus);
  network_.RunFor(0);  // what it said last
}

bool ReplayNetwork::Needs(std::string_view channel) const {
  return network_.IsHeard(channel) && !own_channels_.contains(channel);
}

Status ReplayNetwork::Feed(std::int64_t utime, const std::string& channel, Bytes message,
                           std::int64_t lost_before) {
  network_.RunUntil(utime);
  if (channel == kServiceState.name) {
    const auto state = Decode<fsmsg::service_state_t>(message);
    const auto is_own = [&state](const auto& service) { return service.name == state->name; };
    if (state.ok() && std::any_of(services_.begin(), services_.end(), is_own)) {
      return {};  // here it speaks for itself
    }
  }
  if (!IsStateChannel(channel)) {
    std::int64_t& sequence = sequences_[channel];
    sequence += 1 + lost_before;
    RETURN_IF_ERROR(StampStreamHeader(message, {session_, sequence}));
  }
  Host* dying = DyingWithFiles();
  if (dying == nullptr) {
    return Deliver(utime, channel, message);
  }
  ASSIGN_OR_RETURN(const KeptFolder kept, KeptFolder::Keep(station_.results));
  RETURN_IF_ERROR(Deliver(utime, channel, message));
  if (!dying->killed) {
    return {};
  }
  Remove(dying->known.name);
  return kept.PutBack();
}

Status ReplayNetwork::Deliver(std::int64_t utime, const std::string& channel, ByteView message) {
  RETURN_IF_ERROR(recording_.Publish(channel, message));
  network_.RunUntil(utime);
  return {};
}

ReplayNetwork::Host* ReplayNetwork::DyingWithFiles() {
  const auto host = std::find_if(hosts_.begin(), hosts_.end(), [](const auto& held) {
    return held.second->dying && held.second->known.keeps_files;
  });
  return host == hosts_.end() ? nullptr : host->second.get();
}

void ReplayNetwork::Finish() {
  while (!hosts_.empty()) {
    hosts_.begin()->second->Silence();
    Remove(hosts_.begin()->first);
  }
}

}  // namespace forgescan
