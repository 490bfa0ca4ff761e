#include "tools/forgescan/replay/replay_run.h"

#include <algorithm>
#include <map>
#include <memory>

#include "services/common/bus/channel_list.h"
#include "services/common/bus/channels.h"
#include "services/common/bus/stream_header.h"
#include "tools/forgescan/replay/chained_results.h"
#include "tools/forgescan/replay/recorded_lives.h"
#include "tools/forgescan/replay/replay_network.h"

namespace forgescan {
namespace {

class Run {
 public:
  Run(const RecordedSession& session, const ReplayOptions& options, ReplayOutcome& outcome)
      : session_(session), options_(options), outcome_(outcome), chain_(outcome.comparison) {}

  Status Start(const Station& station) {
    const std::int64_t start_us = session_.events().front().utime;
    ASSIGN_OR_RETURN(const auto lives, LivesOf(session_, options_.services));
    for (std::size_t i = 0; i < lives.size(); ++i) {
      networks_.push_back(std::make_unique<ReplayNetwork>(
          station, options_.services[i], start_us,
          [this](const std::string& channel, ByteView message) { OnResult(channel, message); }));
      for (const RecordedLife& life : lives[i]) {
        RETURN_IF_ERROR(Plan(*networks_.back(), life, start_us));
      }
    }
    return {};
  }

  // The event with that index: what listens, hears it; what begins or ends with it, does so.
  Status Step(std::size_t index) {
    const RecordedEvent& event = session_.events()[index];
    for (auto [begin, end] = begins_.equal_range(index); begin != end; ++begin) {
      RETURN_IF_ERROR(begin->second.network->Begin(begin->second.life, event.utime));
    }
    RETURN_IF_ERROR(options_.chained && chain_.Holds(session_.ChannelOf(event)) ? Pass(event) : Feed(event));
    RETURN_IF_ERROR(FeedWhatIsDue(event.utime));
    for (auto [begin, end] = last_words_.equal_range(index); begin != end; ++begin) {
      begin->second.network->NoteLastWord();
    }
    for (auto [begin, end] = ends_.equal_range(index); begin != end; ++begin) {
      RETURN_IF_ERROR(begin->second.network->End(begin->second.life.how, event.utime));
    }
    RETURN_IF_ERROR(FeedWhatIsDue(event.utime));
    return std::exchange(problem_, Status());
  }

  Status Finish() {
    for (const auto& network : networks_) {
      network->Finish();
    }
    RETURN_IF_ERROR(outcome_.comparison.Finish());
    for (const std::string& changed : outcome_.comparison.changed_records()) {
      auto& all = outcome_.changed_inputs;
      if (std::find(all.begin(), all.end(), changed) == all.end()) {  // one service's result, another's input
        all.push_back(changed);
      }
    }
    return problem_;
  }

 private:
  struct Planned {
    ReplayNetwork* network;
    RecordedLife life;
  };

  void OnResult(const std::string& channel, ByteView message) {
    options_.on_result(channel, message);
    Keep(outcome_.comparison.Add(channel, message));
    if (options_.chained) {
      Keep(chain_.Add(channel, message));
    }
  }

  Status Plan(ReplayNetwork& network, const RecordedLife& life, std::int64_t start_us) {
    if (!life.listened) {
      return {};
    }
    if (life.how != RecordedLife::End::kRunsOn) {
      last_words_.emplace(life.last_word, Planned{&network, life});
      ends_.emplace(life.end, Planned{&network, life});
    }
    if (life.begin.has_value()) {
      begins_.emplace(*life.begin, Planned{&network, life});
      return {};
    }
    return network.Begin(life, start_us);
  }

  std::vector<ReplayNetwork*> ReceiversOf(const std::string& channel) const {
    std::vector<ReplayNetwork*> receivers;
    for (const auto& network : networks_) {
      if (network->Needs(channel) || channel == kServiceState.name) {
        receivers.push_back(network.get());
      }
    }
    return receivers;
  }

  // The place of a recorded result, which the replay's own takes.
  Status Pass(const RecordedEvent& event) {
    for (const auto& network : networks_) {
      network->RunUntil(event.utime);  // it may be given by a timeout
    }
    ASSIGN_OR_RETURN(const Bytes start, session_.ReadStart(event, kStreamHeaderBytes));
    if (const auto utime = StreamUtime(start); utime.ok()) {
      chain_.Pass(session_.ChannelOf(event), *utime);
    }
    return {};
  }

  Status FeedWhatIsDue(std::int64_t utime) {
    while (const auto due = chain_.Take()) {
      for (ReplayNetwork* network : ReceiversOf(due->first)) {
        RETURN_IF_ERROR(network->Feed(utime, due->first, due->second, 0));
      }
    }
    return {};
  }

  Status Feed(const RecordedEvent& event) {
    const std::string& channel = session_.ChannelOf(event);
    const std::vector<ReplayNetwork*> receivers = ReceiversOf(channel);
    if (receivers.empty()) {
      return {};
    }
    ASSIGN_OR_RETURN(Bytes message, session_.Read(event));
    std::int64_t lost_before = 0;
    if (!IsStateChannel(channel)) {
      const Result<StreamHeader> header = CheckStreamHeader(message);
      if (!header.ok()) {  // the services would not take it either
        outcome_.changed_inputs.push_back(NotAsSent(session_, event, message, header.error()));
        return {};
      }
      lost_before = LostBefore(channel, *header);
    }
    for (ReplayNetwork* network : receivers) {
      RETURN_IF_ERROR(network->Feed(event.utime, channel, message, lost_before));
    }
    return {};
  }

  void Keep(const Status& status) {
    if (problem_.ok()) {
      problem_ = status;
    }
  }

  std::int64_t LostBefore(const std::string& channel, const StreamHeader& header) {
    const auto before = last_.find(channel);
    const std::int64_t lost =
        before == last_.end() ? 0 : session_.LostBetween(channel, before->second, header);
    last_[channel] = header;
    return lost;
  }

  const RecordedSession& session_;
  const ReplayOptions& options_;
  ReplayOutcome& outcome_;
  ChainedResults chain_;
  std::vector<std::unique_ptr<ReplayNetwork>> networks_;
  std::multimap<std::size_t, Planned> begins_, last_words_, ends_;  // by the event
  std::map<std::string, StreamHeader> last_;                        // fed, by channel
  Status problem_;                                                  // the first of the comparison
};

}  // namespace

Result<ReplayOutcome> Replay(const RecordedSession& session, const Station& station,
                             const ReplayOptions& options) {
  std::vector<std::string> channels;
  for (const ReplayableService& service : options.services) {
    channels.insert(channels.end(), service.results.begin(), service.results.end());
  }
  ASSIGN_OR_RETURN(ResultComparison comparison, ResultComparison::Create(session, channels));
  ReplayOutcome outcome{std::move(comparison), {}};
  if (session.events().empty()) {
    return Fail(ErrorCode::kInvalidArgument, "the recording holds no message to replay");
  }
  Run run(session, options, outcome);
  RETURN_IF_ERROR(run.Start(station));
  for (std::size_t i = 0; i < session.events().size(); ++i) {
    if (options.interrupted()) {
      return Fail(ErrorCode::kUnavailable, "interrupted");
    }
    RETURN_IF_ERROR(run.Step(i));
    options.on_progress(static_cast<double>(i + 1) / static_cast<double>(session.events().size()));
  }
  RETURN_IF_ERROR(run.Finish());
  return outcome;
}

}  // namespace forgescan
