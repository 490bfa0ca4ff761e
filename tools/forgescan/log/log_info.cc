#include "tools/forgescan/log/log_info.h"

#include <algorithm>
#include <map>

#include "services/common/bus/big_endian.h"
#include "tools/forgescan/log/shown_text.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

struct ChannelSummary {
  std::int64_t events = 0;
  std::uint64_t bytes = 0;
  std::int64_t first_utime = 0, last_utime = 0;
  const LogEntry* first = nullptr;
  const LogEntry* last = nullptr;
};

std::map<std::string, ChannelSummary> Summarise(const LogReader& log) {
  std::map<std::string, ChannelSummary> channels;
  for (const LogEntry& entry : log.entries()) {
    ChannelSummary& channel = channels[log.ChannelOf(entry)];
    channel.first_utime = channel.events == 0 ? entry.utime : std::min(channel.first_utime, entry.utime);
    channel.last_utime = channel.events == 0 ? entry.utime : std::max(channel.last_utime, entry.utime);
    channel.first = channel.events == 0 ? &entry : channel.first;
    channel.last = &entry;
    ++channel.events;
    channel.bytes += entry.bytes;
  }
  return channels;
}

// The types of the first and the last message: one, or two that differ.
Result<Json> TypesOf(const Recording& recording, const ChannelSummary& channel) {
  Json types = Json::array();
  for (const LogEntry* entry : {channel.first, channel.last}) {
    ASSIGN_OR_RETURN(const Bytes message, recording.log.Read(*entry));
    if (message.size() < sizeof(std::int64_t)) {
      continue;
    }
    const LcmStruct* type = recording.types.TypeOf(message);
    Json one{{"fingerprint", fmt::format("{:016x}", BigEndianAt<std::uint64_t>(message, 0))},
             {"type", type == nullptr ? Json() : Json(type->name)}};
    if (types.empty() || types.back() != one) {
      types.push_back(std::move(one));
    }
  }
  return types;
}

Result<Json> Channels(const Recording& recording) {
  Json json = Json::array();
  for (const auto& [name, channel] : Summarise(recording.log)) {
    const auto span_us = static_cast<double>(channel.last_utime) - static_cast<double>(channel.first_utime);
    ASSIGN_OR_RETURN(Json types, TypesOf(recording, channel));
    json.push_back(
        {{"channel", name},
         {"events", channel.events},
         {"bytes", channel.bytes},
         {"rate_hz", span_us > 0 ? Json(static_cast<double>(channel.events - 1) * 1e6 / span_us) : Json()},
         {"first_utime", channel.first_utime},
         {"last_utime", channel.last_utime},
         {"types", std::move(types)}});
  }
  return json;
}

Json Opened(const fsmsg::recording_opened_t& opened) {
  return {{"utime", opened.utime},
          {"part", opened.part},
          {"volume", opened.volume},
          {"station", opened.station},
          {"version", opened.version},
          {"build", opened.build},
          {"config_hash", opened.config_hash}};
}

Json Closed(const fsmsg::recording_closed_t& closed) {
  Json gaps = Json::array();
  for (const fsmsg::recording_gap_t& gap : closed.gaps) {
    gaps.push_back({{"channel", gap.channel},
                    {"session", gap.session},
                    {"first_sequence", gap.first_sequence},
                    {"last_sequence", gap.last_sequence},
                    {"reason", gap.reason},
                    {"text", GapText(gap)}});
  }
  return {{"utime", closed.utime},
          {"part", closed.part},
          {"verdict", VerdictName(closed.verdict)},
          {"reason", closed.reason},
          {"gaps", std::move(gaps)}};
}

std::string ShownText(const Json& text) { return Shown(text.get<std::string>()); }

std::string ChannelLine(const Json& channel, double begin_us) {
  const auto seconds = [begin_us](const Json& utime) { return (utime.get<double>() - begin_us) * 1e-6; };
  std::string types;
  for (const Json& type : channel["types"]) {
    types += fmt::format("  {} {}", type["fingerprint"].get<std::string>(),
                         type["type"].is_null() ? "(unknown type)" : type["type"].get<std::string>());
  }
  return fmt::format(
      "  {:<22} {:>9} {:>14} {:>9} {:>10.3f} {:>10.3f}{}\n", channel["channel"].get<std::string>(),
      channel["events"].get<std::int64_t>(), channel["bytes"].get<std::uint64_t>(),
      channel["rate_hz"].is_null() ? "-" : fmt::format("{:.2f}", channel["rate_hz"].get<double>()),
      seconds(channel["first_utime"]), seconds(channel["last_utime"]), types);
}

std::string RecordingLines(const Json& info) {
  std::string text;
  if (const Json& opened = info["opened"]; !opened.is_null()) {
    const int part = opened["part"].get<int>();
    text += fmt::format("  recording of {} at station {}, version {} ({}), configuration {}\n",
                        part < 0 ? fmt::format("the station, volume {}", opened["volume"].get<int>())
                                 : fmt::format("part {}", part),
                        ShownText(opened["station"]), ShownText(opened["version"]),
                        ShownText(opened["build"]), ShownText(opened["config_hash"]));
  }
  if (const Json& closed = info["closed"]; !closed.is_null()) {
    text += fmt::format("  closed: {}; verdict {}; {} gaps\n", ShownText(closed["reason"]),
                        closed["verdict"].get<std::string>(), closed["gaps"].size());
    for (const Json& gap : closed["gaps"]) {
      const std::string channel = ShownText(gap["channel"]);
      text +=
          fmt::format("    missing: {}{}{}\n", channel, channel.empty() ? "" : ": ", ShownText(gap["text"]));
    }
  } else if (!info["opened"].is_null()) {
    text += "  not closed: whoever recorded it did not come to the end\n";
  }
  return text;
}

}  // namespace

Result<Json> LogInfo(const Recording& recording) {
  const LogReader& log = recording.log;
  const auto [first, last] =
      std::minmax_element(log.entries().begin(), log.entries().end(),
                          [](const LogEntry& a, const LogEntry& b) { return a.utime < b.utime; });
  Json info{{"file", log.path()},
            {"file_bytes", log.file_bytes()},
            {"events", log.entries().size()},
            {"first_utime", first->utime},
            {"last_utime", last->utime}};
  ASSIGN_OR_RETURN(info["channels"], Channels(recording));
  info["damage"] = Json::array();
  for (const LogDamage& damage : log.damage()) {
    info["damage"].push_back({{"offset", damage.offset}, {"bytes", damage.bytes}, {"what", damage.what}});
  }
  info["opened"] = recording.opened ? Opened(*recording.opened) : Json();
  info["closed"] = recording.closed ? Closed(*recording.closed) : Json();
  return info;
}

std::string LogInfoText(const Json& info) {
  const auto begin_us = info["first_utime"].get<double>();
  std::string text =
      fmt::format("{}: {} events, {} bytes, {:.1f} s from {}\n", info["file"].get<std::string>(),
                  info["events"].get<std::uint64_t>(), info["file_bytes"].get<std::uint64_t>(),
                  (info["last_utime"].get<double>() - begin_us) * 1e-6,
                  TimeText(info["first_utime"].get<std::int64_t>()));
  text += RecordingLines(info);
  text += fmt::format("  {:<22} {:>9} {:>14} {:>9} {:>10} {:>10}  {}\n", "channel", "events", "bytes",
                      "per s", "first s", "last s", "fingerprint, type");
  for (const Json& channel : info["channels"]) {
    text += ChannelLine(channel, begin_us);
  }
  for (const Json& damage : info["damage"]) {
    text += fmt::format("  damage: {} bytes at byte {}: {}\n", damage["bytes"].get<std::uint64_t>(),
                        damage["offset"].get<std::uint64_t>(), damage["what"].get<std::string>());
  }
  return text;
}

}  // namespace forgescan
