// forgescan play LOG...: a recording on a live bus.
#include <algorithm>

#include "services/common/bus/channel_list.h"
#include "services/common/bus/lcm_bus.h"
#include "services/common/bus/stream_hub.h"
#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/replay/recorded_session.h"
#include "tools/forgescan/station/interrupt.h"

namespace forgescan {
namespace {

constexpr std::int64_t kAnnounceUs = 500'000;  // receivers hear of the streams before their first message
constexpr std::int64_t kQuietUs = 2'000'000;   // no request for so long: everybody has everything

struct PlayArguments {
  std::vector<std::string> logs;
  std::string bus_url;
  double speed = 1.0;
  std::vector<std::string> channels;  // empty = all
  std::vector<std::string> without;
};

class Player {
 public:
  Player(const RecordedSession& session, LcmBus& bus, const PlayArguments& arguments)
      : session_(session), bus_(bus), arguments_(arguments), hub_(bus, "play") {}

  // False if interrupted.
  Result<bool> Run() {
    for (const RecordedEvent& event : session_.events()) {
      const std::string& channel = session_.ChannelOf(event);
      if (Wanted(channel) && !IsStateChannel(channel)) {
        hub_.AdvertiseChannel(channel);
      }
    }
    RETURN_IF_ERROR(WaitUntil(bus_.NowUs() + kAnnounceUs));
    const std::int64_t start_us = bus_.NowUs();
    for (const RecordedEvent& event : session_.events()) {
      const auto since_us = static_cast<double>(event.utime - session_.events().front().utime);
      RETURN_IF_ERROR(WaitUntil(start_us + static_cast<std::int64_t>(since_us / arguments_.speed)));
      if (interrupt_.Requested()) {
        return false;
      }
      RETURN_IF_ERROR(Send(event));
    }
    RETURN_IF_ERROR(WaitForLateRequests());
    return true;
  }

  std::int64_t sent() const { return sent_; }
  std::int64_t resent() const { return hub_.counters().resent; }

 private:
  bool Wanted(const std::string& channel) const {
    const auto named = [&channel](const auto& list) {
      return std::find(list.begin(), list.end(), channel) != list.end();
    };
    return (arguments_.channels.empty() || named(arguments_.channels)) && !named(arguments_.without);
  }

  Status Send(const RecordedEvent& event) {
    const std::string& channel = session_.ChannelOf(event);
    if (!Wanted(channel)) {
      return {};
    }
    ASSIGN_OR_RETURN(Bytes message, session_.Read(event));
    ++sent_;
    return IsStateChannel(channel) ? bus_.Publish(channel, message)
                                   : hub_.PublishBytes(channel, std::move(message));
  }

  Status WaitUntil(std::int64_t until_us) {
    do {
      RETURN_IF_ERROR(bus_.RunOnce(std::clamp<std::int64_t>(until_us - bus_.NowUs(), 0, 100'000)));
    } while (bus_.NowUs() < until_us && !interrupt_.Requested());
    return {};
  }

  Status WaitForLateRequests() {
    std::int64_t resent_before = -1;
    while (resent() != resent_before && !interrupt_.Requested()) {
      resent_before = resent();
      RETURN_IF_ERROR(WaitUntil(bus_.NowUs() + kQuietUs));
    }
    return {};
  }

  const RecordedSession& session_;
  LcmBus& bus_;
  const PlayArguments& arguments_;
  StreamHub hub_;
  const Interrupt interrupt_;
  std::int64_t sent_ = 0;
};

Status RunPlay(const PlayArguments& arguments) {
  ASSIGN_OR_RETURN(const auto session, RecordedSession::Open(arguments.logs));
  ASSIGN_OR_RETURN(const auto bus, LcmBus::Open(arguments.bus_url));
  for (const std::string& finding : session.findings()) {
    fmt::print("recording: {}\n", finding);
  }
  Player player(session, *bus, arguments);
  ASSIGN_OR_RETURN(const bool finished, player.Run());
  fmt::print("{} messages played, {} sent again on request\n", player.sent(), player.resent());
  return finished ? Status() : Fail(ErrorCode::kUnavailable, "interrupted");
}

}  // namespace

void AddPlayCommand(CLI::App& app, Status& outcome) {
  static PlayArguments arguments;
  CLI::App* command = app.add_subcommand(
      "play", "send a recording on a live bus, with the resend protocol, so that nothing is lost");
  command->add_option("LOG", arguments.logs, "recordings of parts, in any order")->required();
  command->add_option("--bus", arguments.bus_url, "the bus; never that of a station at work")->required();
  command->add_option("--speed", arguments.speed, "times as fast as it was recorded")
      ->check(FiniteRange(0.01, 100))
      ->capture_default_str();
  command->add_option("--channel", arguments.channels, "only this channel; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--without", arguments.without, "not this channel; may be repeated")
      ->allow_extra_args(false);
  command->callback([&outcome] { outcome = RunPlay(arguments); });
}

}  // namespace forgescan
