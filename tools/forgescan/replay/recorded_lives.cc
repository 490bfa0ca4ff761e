#include "tools/forgescan/replay/recorded_lives.h"

#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/bus/stream_header.h"

namespace forgescan {
namespace {

using State = fsmsg::service_state_t;

// What was heard of one session.
struct Heard {
  std::int64_t session = 0;
  std::size_t first = 0, last = 0;  // events
  int words = 0;
  bool starting_heard = false;          // its first word is STARTING
  std::optional<std::size_t> ready;     // first word past STARTING
  std::optional<std::size_t> stopping;  // first word that it stops
  std::map<std::string, std::int64_t, std::less<>> last_utime;
};

// One word of a service.
struct Word {
  std::size_t event = 0;
  std::int64_t session = 0;
  std::int8_t state = State::STATE_UNKNOWN;  // of SERVICE_STATE; of a stream's message UNKNOWN
};

Heard& Add(const Word& word, std::vector<Heard>& sessions) {
  auto heard = std::find_if(sessions.begin(), sessions.end(),
                            [&word](const auto& known) { return known.session == word.session; });
  if (heard == sessions.end()) {
    heard = sessions.insert(sessions.end(), Heard{});
    heard->session = word.session;
    heard->first = word.event;
    heard->starting_heard = word.state == State::STATE_STARTING;
  }
  ++heard->words;
  heard->last = word.event;
  if (!heard->ready.has_value() && word.state != State::STATE_STARTING) {
    heard->ready = word.event;
  }
  if (!heard->stopping.has_value() && word.state == State::STATE_STOPPING) {
    heard->stopping = word.event;
  }
  return *heard;
}

constexpr std::int64_t kWordsApartUs = 1'000'000;  // SERVICE_STATE comes at least so often

// The last event that the killed service may have heard.
std::size_t EndOf(const std::vector<RecordedEvent>& events, const Heard& heard, const Heard& next) {
  std::size_t end = std::min(heard.last, next.first - 1);  // a late word may come after the next one's
  const std::int64_t until_us = std::min(events[end].utime + kWordsApartUs, next.session);
  while (end + 1 < next.first && events[end + 1].utime < until_us) {
    ++end;
  }
  return end;
}

RecordedLife LifeOf(const std::vector<RecordedEvent>& events, const Heard& heard, const Heard* next,
                    bool is_first) {
  RecordedLife life;
  life.session = heard.session;
  life.last_utime = heard.last_utime;
  life.listened = heard.ready.has_value();
  if (!is_first || heard.starting_heard) {
    life.begin = heard.ready;
  }
  if (heard.stopping.has_value()) {
    life.how = RecordedLife::End::kStopped;
    life.end = life.last_word = *heard.stopping;
  } else if (next != nullptr) {
    life.how = RecordedLife::End::kKilled;
    life.last_word = std::min(heard.last, next->first - 1);
    life.end = EndOf(events, heard, *next);
  }
  if (life.how != RecordedLife::End::kRunsOn && life.begin.has_value() && *life.begin > life.end) {
    life.listened = false;
  }
  return life;
}

std::vector<RecordedLife> LivesOf(const std::vector<RecordedEvent>& events, std::vector<Heard> sessions) {
  std::erase_if(sessions, [](const auto& heard) { return heard.words < 2; });
  std::vector<RecordedLife> lives;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    const Heard* next = i + 1 < sessions.size() ? &sessions[i + 1] : nullptr;
    lives.push_back(LifeOf(events, sessions[i], next, i == 0));
  }
  return lives.empty() ? std::vector<RecordedLife>(1) : lives;
}

class Listener {
 public:
  Listener(const RecordedSession& session, const std::vector<ReplayableService>& services)
      : session_(session), heard_(services.size()) {
    for (std::size_t i = 0; i < services.size(); ++i) {
      names_[services[i].name] = i;
      for (const auto* channels : {&services[i].results, &services[i].durations}) {
        for (const char* channel : *channels) {
          channels_[channel] = i;
        }
      }
    }
  }

  Status Add(std::size_t index) {
    const RecordedEvent& event = session_.events()[index];
    const std::string& channel = session_.ChannelOf(event);
    if (channel == kServiceState.name) {
      ASSIGN_OR_RETURN(const Bytes message, session_.Read(event));
      const auto state = Decode<State>(message);
      if (state.ok() && names_.contains(state->name)) {
        forgescan::Add({index, state->session, state->state}, heard_[names_[state->name]]);
      }
    } else if (const auto service = channels_.find(channel); service != channels_.end()) {
      ASSIGN_OR_RETURN(const Bytes start, session_.ReadStart(event, kStreamHeaderBytes));
      const auto header = ReadStreamHeader(start);
      if (header.ok()) {
        Heard& heard = forgescan::Add({index, header->session}, heard_[service->second]);
        std::int64_t& utime = heard.last_utime[channel];
        const auto event_utime = StreamUtime(start);
        utime = std::max(utime, event_utime.ok() ? *event_utime : 0);
      }
    }
    return {};
  }

  const std::vector<std::vector<Heard>>& heard() const { return heard_; }

 private:
  const RecordedSession& session_;
  std::map<std::string, std::size_t, std::less<>> names_, channels_;  // to the service
  std::vector<std::vector<Heard>> heard_;
};

}  // namespace

Result<std::vector<std::vector<RecordedLife>>> LivesOf(const RecordedSession& session,
                                                       const std::vector<ReplayableService>& services) {
  Listener listener(session, services);
  for (std::size_t i = 0; i < session.events().size(); ++i) {
    RETURN_IF_ERROR(listener.Add(i));
  }
  std::vector<std::vector<RecordedLife>> lives;
  for (const std::vector<Heard>& heard : listener.heard()) {
    lives.push_back(LivesOf(session.events(), heard));
  }
  return lives;
}

}  // namespace forgescan
