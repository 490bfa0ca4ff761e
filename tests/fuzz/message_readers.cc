// What comes over the bus: messages of every type, the resend protocol, clouds in slices.
#include "fsmsg/channel_total_t.hpp"
#include "fsmsg/counter_t.hpp"
#include "fsmsg/dimension_t.hpp"
#include "fsmsg/fused_view_t.hpp"
#include "fsmsg/resend_piece_t.hpp"
#include "fsmsg/resend_request_t.hpp"
#include "fsmsg/stream_status_t.hpp"
#include "fsmsg/stream_t.hpp"
#include "services/common/bus/channels.h"
#include "services/common/bus/cloud_stream.h"
#include "services/common/bus/protocol_channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_header.h"
#include "services/common/bus/stream_hub.h"
#include "services/common/log/lcm_decode.h"
#include "services/common/log/message_definitions.h"
#include "tests/fuzz/random_message.h"
#include "tests/fuzz/readers.h"

namespace forgescan::fuzz {
namespace {

const LcmTypes& Types() {
  static const LcmTypes types = LcmTypes::Parse(AllMessageDefinitions()).value();
  return types;
}

Bytes BytesOf(const std::string& text) { return {text.begin(), text.end()}; }
std::string TextOf(const Bytes& bytes) { return {bytes.begin(), bytes.end()}; }

// The generated code and the decoder by definition agree on what is a message.
template <typename Message>
Outcome ReadAs(const Bytes& bytes) {
  const auto message = Decode<Message>(bytes);
  const auto json = DecodeToJson(Types(), bytes);
  if (message.ok() != json.ok()) {
    return {false, fmt::format("{}: one decoder says {}, the other {}", Message::getTypeName(),
                               message.ok() ? "good" : message.error().message,
                               json.ok() ? "good" : json.error().message)};
  }
  if (!message.ok()) {
    const std::string problem = SentenceProblem(message.error(), "");
    return {false, problem.empty() ? SentenceProblem(json.error(), "") : problem};
  }
  return {true, Encode(*message).size() == bytes.size() ? "" : "a message that is written differently"};
}

struct MessageType {
  std::int64_t fingerprint;
  Outcome (*read)(const Bytes&);
};

template <typename... Messages>
std::vector<MessageType> TypeList() {
  return {{Messages::getHash(), ReadAs<Messages>}...};
}

const std::vector<MessageType>& AllTypes() {
  using namespace fsmsg;
  static const auto types =
      TypeList<channel_total_t, cloud_slice_t, cooling_state_t, counter_t, dimension_t, exposure_t, frame_t,
               fused_view_t, fusion_result_t, part_arrived_t, part_sorted_t, part_temperature_t, path_state_t,
               processing_time_t, recorded_channel_t, recorded_file_t, recorder_state_t, recording_closed_t,
               recording_gap_t, recording_opened_t, registration_t, resend_piece_t, resend_request_t,
               scan_complete_t, service_state_t, stream_status_t, stream_t, verdict_t, view_captured_t,
               view_frames_t, view_ready_t, view_result_t>();
  return types;
}

Outcome ReadMessage(const std::string& text) {
  const Bytes bytes = BytesOf(text);
  const LcmStruct* type = Types().TypeOf(bytes);
  for (const MessageType& known : AllTypes()) {
    if (type != nullptr && Types().Fingerprint(*type) == known.fingerprint) return known.read(bytes);
  }
  return ReadAs<fsmsg::verdict_t>(bytes);
}

std::vector<std::string> MessageSeeds() {
  std::vector<std::string> seeds;
  for (std::uint64_t seed = 0; seed < 2; ++seed) {
    for (const LcmStruct& type : Types().structs()) {
      seeds.push_back(TextOf(RandomMessage(Types(), type, seed)));
    }
  }
  return seeds;
}

// A row of datagrams: channel, length in two bytes, bytes. The highest bit of the channel: with the checksum
// that a stream message of these bytes has.
constexpr std::array kChannels = {"VERDICT", "VIEW_CLOUD", kStreamStatusChannel, kResendPieceChannel,
                                  kResendRequestChannel};

std::string Datagram(std::uint8_t channel, const Bytes& message) {
  std::string text = {static_cast<char>(channel), static_cast<char>(message.size() >> 8),
                      static_cast<char>(message.size() & 0xff)};
  return text + TextOf(message);
}

Outcome ReadStreams(const std::string& text) {
  SimNetwork network;
  SimBus& ours = network.AddNode();
  SimBus& theirs = network.AddNode();
  StreamHub hub(ours, "fuzzed");
  CloudAssembler clouds;
  std::int64_t delivered = 0;
  hub.Subscribe<fsmsg::verdict_t>(kVerdict, [&](const auto&) { ++delivered; });
  hub.Subscribe<fsmsg::cloud_slice_t>(kViewCloud, [&](const auto& slice) {
    static_cast<void>(clouds.Add(slice).ok());  // a slice that does not fit is told by its error
    ++delivered;
  });
  for (std::size_t at = 0; at + 3 <= text.size();) {
    const auto channel = static_cast<std::uint8_t>(text[at]);
    const std::size_t size = static_cast<std::size_t>(static_cast<std::uint8_t>(text[at + 1])) << 8 |
                             static_cast<std::uint8_t>(text[at + 2]);
    Bytes message = BytesOf(text.substr(at + 3, size));
    if (channel >= 0x80) {
      const auto header = ReadStreamHeader(message);
      if (header.ok()) static_cast<void>(StampStreamHeader(message, *header).ok());
    }
    static_cast<void>(theirs.Publish(kChannels[(channel & 0x7f) % kChannels.size()], message).ok());
    network.RunFor(1000);
    at += 3 + size;
  }
  network.RunFor(25'000'000);  // all that is missing has been asked for and given up
  const StreamStanding standing = hub.Standing(kVerdict.name);
  if (standing.waiting()) return {true, "a stream that waits for ever"};
  return {true, hub.counters().delivered < delivered ? "more delivered than counted" : ""};
}

std::string StreamSeed() {
  SimNetwork network;
  SimBus& bus = network.AddNode();
  SimBus& listener = network.AddNode();
  std::string text;
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    listener.Subscribe(kChannels[i], [&text, i](ByteView bytes) {
      text += Datagram(static_cast<std::uint8_t>(i < 2 ? i | 0x80 : i), {bytes.begin(), bytes.end()});
    });
  }
  StreamHub hub(bus, "sender");
  PointCloud cloud;
  cloud.points.resize(3);
  cloud.normals.resize(3);
  cloud.sigma_mm.resize(3);
  cloud.view.resize(3);
  for (int part = 1; part <= 3; ++part) {
    fsmsg::verdict_t verdict{};
    verdict.part = part;
    static_cast<void>(hub.Publish(kVerdict, verdict).ok());
    static_cast<void>(hub.Publish(kViewCloud, SliceCloud(cloud, part, part, 0).value()[0]).ok());
    network.RunFor(30'000);
    fsmsg::resend_request_t request{};
    request.channel = kVerdict.name;
    request.session = hub.session();
    request.sequence = part;
    static_cast<void>(listener.Publish(kResendRequestChannel, Encode(request)).ok());
    network.RunFor(30'000);
  }
  return text;
}

}  // namespace

std::vector<Reader> Readers() {
  return {{"message", 30'000, MessageSeeds(), ReadMessage}, {"streams", 1500, {StreamSeed()}, ReadStreams}};
}

}  // namespace forgescan::fuzz
