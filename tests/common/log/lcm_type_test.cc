#include "services/common/log/lcm_type.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "fsmsg/frame_t.hpp"
#include "fsmsg/fusion_result_t.hpp"
#include "fsmsg/recorded_file_t.hpp"
#include "fsmsg/recorder_state_t.hpp"
#include "fsmsg/recording_closed_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "fsmsg/registration_t.hpp"
#include "fsmsg/resend_piece_t.hpp"
#include "fsmsg/resend_request_t.hpp"
#include "fsmsg/service_state_t.hpp"
#include "fsmsg/stream_status_t.hpp"
#include "fsmsg/verdict_t.hpp"
#include "services/common/bus/channels.h"
#include "services/common/bus/codec.h"
#include "services/common/log/lcm_decode.h"
#include "services/common/log/log_reader.h"
#include "services/common/log/message_definitions.h"
#include "tests/common/real_data.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::ordered_json;

LcmTypes OurTypes() {
  std::string text;
  for (const MessageDefinition& definition : MessageDefinitions()) {
    text += definition.text;
  }
  auto types = LcmTypes::Parse(text);
  EXPECT_TRUE(types.ok()) << types.error().message;
  return types.ok() ? *types : LcmTypes();
}

LcmTypes Types(const std::string& text) {
  auto types = LcmTypes::Parse(text);
  EXPECT_TRUE(types.ok()) << types.error().message;
  return types.ok() ? *types : LcmTypes();
}

template <typename... Messages>
int CountDifferentFingerprints(const LcmTypes& types) {
  const auto differs = [&types]<typename Message>(const Message&) {
    const LcmStruct* type = types.Find(std::string("fsmsg.") + Message::getTypeName());
    const bool equal = type != nullptr && types.Fingerprint(*type) == Message::getHash();
    EXPECT_TRUE(equal) << Message::getTypeName();
    return equal ? 0 : 1;
  };
  return (differs(Messages{}) + ...);
}

// Against what lcm-gen itself computes.
TEST(LcmType, StartsWithTheFingerprintsOfOurTypes) {
  const LcmTypes types = OurTypes();
  EXPECT_EQ(types.structs().size(), MessageDefinitions().size());
  const int different = CountDifferentFingerprints<
      fsmsg::part_arrived_t, fsmsg::view_ready_t, fsmsg::exposure_t, fsmsg::view_captured_t, fsmsg::frame_t,
      fsmsg::view_frames_t, fsmsg::part_temperature_t, fsmsg::scan_complete_t, fsmsg::cloud_slice_t,
      fsmsg::view_result_t, fsmsg::fusion_result_t, fsmsg::fused_view_t, fsmsg::registration_t,
      fsmsg::verdict_t, fsmsg::dimension_t, fsmsg::part_sorted_t, fsmsg::processing_time_t,
      fsmsg::path_state_t, fsmsg::cooling_state_t, fsmsg::recorder_state_t, fsmsg::service_state_t,
      fsmsg::counter_t, fsmsg::stream_status_t, fsmsg::stream_t, fsmsg::resend_request_t,
      fsmsg::resend_piece_t, fsmsg::recording_opened_t, fsmsg::recorded_channel_t, fsmsg::recorded_file_t,
      fsmsg::recording_closed_t, fsmsg::channel_total_t, fsmsg::recording_gap_t>(types);
  EXPECT_EQ(different, 0);
}

// Computed by lcm-gen 1.3.1 from the same text.
TEST(LcmType, FingerprintsCoverArraysNestingAndRecursion) {
  const LcmTypes types = Types(R"(
    package a.b;  /* a comment; struct not_this { int8_t x; } */
    struct inner_t { int8_t n; float xyz[0x3][2]; string words[n]; boolean b; byte raw[n][4]; int16_t s; }
    struct outer_t {
      // fields of several forms
      const int32_t kA = -7, kB = 0x10; const double kC = 1.5e-3;
      int64_t utime, count; a.b.inner_t one; inner_t many[count], grid[count][2];
      outer_t self[count];
    }
    package other; struct user_t { a.b.outer_t o; double d; })");
  const std::vector<std::pair<std::string, std::uint64_t>> expected{{"a.b.inner_t", 0x7c1c925fd469702dU},
                                                                    {"a.b.outer_t", 0x1d6a7000fe691829U},
                                                                    {"other.user_t", 0x5cb221117bf95e73U}};
  for (const auto& [name, fingerprint] : expected) {
    const LcmStruct* type = types.Find(name);
    ASSERT_NE(type, nullptr) << name;
    EXPECT_EQ(static_cast<std::uint64_t>(types.Fingerprint(*type)), fingerprint) << name;
    EXPECT_EQ(types.FindByFingerprint(types.Fingerprint(*type)), type);
  }
  const LcmStruct& outer = *types.Find("a.b.outer_t");
  ASSERT_EQ(outer.constants.size(), 3u);
  EXPECT_EQ(outer.constants[0].value, "-7");
  EXPECT_EQ(outer.constants[2].value, "1.5e-3");
  EXPECT_EQ(outer.fields[3].type, "a.b.inner_t");
  EXPECT_EQ(outer.fields[4].dimensions[1].fixed, 2);
}

TEST(LcmType, RefusesWhatIsNoDefinition) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"strict a_t {}", "line 1: \"strict\" stands where"},
      {"struct a_t {", "line 1: \"the end of the text\" stands"},
      {"struct a_t { int32_t }", "where a name should"},
      {"struct a_t {\n int32_t a\n}", "line 3: \"}\" stands where ; should"},
      {"struct a_t { int32_t a; int8_t a; }", "two members a"},
      {"struct a_t { const int8_t a = ; }", "value of a constant"},
      {"struct a_t { int8_t v[n]; }", "an earlier integer field"},
      {"struct a_t { double n; int8_t v[n]; }", "an earlier integer field"},
      {"struct a_t { int8_t v[0]; }", "a number from 1 to"},
      {"struct a_t { int8_t v[99999999999]; }", "a number from 1 to"},
      {"struct a_t { b_t b; }", "b_t, which is not defined"},
      {"struct a_t { } struct a_t { }", "defined twice"},
      {"enum a_t { X }", "\"enum\" stands where"},
      {"package a..b;", "a type's name"},
      {"struct 1a { }", "where a name should"}};
  for (const auto& [text, sentence] : wrong) {
    const auto types = LcmTypes::Parse(text);
    ASSERT_FALSE(types.ok()) << text;
    EXPECT_EQ(types.error().code, ErrorCode::kFormat);
    EXPECT_THAT(types.error().message, HasSubstr(sentence)) << text;
  }
  EXPECT_TRUE(LcmTypes::Parse("").ok());
  EXPECT_TRUE(LcmTypes::Parse("struct a_t { int8_t v; } // no end of line").ok());
}

TEST(LcmType, BoundsWhatATextCanDemand) {
  std::string doubling = "struct t0 { int8_t x; } ", chain = "struct t0 { int8_t x; } ";
  for (int i = 1; i < 40; ++i) {
    doubling += fmt::format("struct t{} {{ t{} a, b; }} ", i, i - 1);
  }
  for (int i = 1; i < 60; ++i) {
    chain += fmt::format("struct t{} {{ t{} a; }} ", i, i - 1);
  }
  for (const std::string& text : {doubling, chain}) {
    const auto types = LcmTypes::Parse(text);
    ASSERT_FALSE(types.ok());
    EXPECT_THAT(types.error().message,
                HasSubstr("contains more than 5000 structs, or structs more than 32 deep"));
  }
}

TEST(LcmType, KnowsStreams) {
  const LcmTypes types = OurTypes();
  EXPECT_TRUE(types.Find("fsmsg.frame_t")->IsStream());
  EXPECT_FALSE(types.Find("fsmsg.service_state_t")->IsStream());
  EXPECT_FALSE(types.Find("fsmsg.stream_t")->IsStream());
  EXPECT_EQ(types.Find("frame_t"), nullptr);
  EXPECT_EQ(types.TypeOf(Bytes(7)), nullptr);
  EXPECT_EQ(types.TypeOf(Bytes(8)), nullptr);
}

fsmsg::verdict_t Verdict() {
  fsmsg::verdict_t verdict{};
  verdict.utime = 1'700'000'000'123'456;
  verdict.part = 7;
  verdict.verdict = fsmsg::verdict_t::VERDICT_NOT_OK;
  verdict.reason = "the shaft is too short";
  verdict.dimensions.resize(2);
  verdict.dimension_count = 2;
  verdict.dimensions[1].name = "shaft";
  verdict.dimensions[1].measured_mm = std::numeric_limits<double>::quiet_NaN();
  return verdict;
}

TEST(LcmDecode, GivesTheFieldsInTheirOrder) {
  const auto json = DecodeToJson(OurTypes(), Encode(Verdict()));
  ASSERT_TRUE(json.ok()) << json.error().message;
  EXPECT_EQ(json->items().begin().key(), "utime");
  EXPECT_EQ((*json)["utime"], 1'700'000'000'123'456);
  EXPECT_EQ((*json)["verdict"], 2);
  EXPECT_EQ((*json)["reason"], "the shaft is too short");
  ASSERT_EQ((*json)["dimensions"].size(), 2u);
  EXPECT_EQ((*json)["dimensions"][1]["name"], "shaft");
  EXPECT_TRUE((*json)["dimensions"][1]["measured_mm"].is_null());  // NaN
}

// The fingerprints in a log of other people's programs are those of its types, and all of it decodes.
TEST(LcmDecode, DecodesARealLog) {
  const auto data = RealData("lcm-log");
  if (!data) GTEST_SKIP() << "lcm-log" << kNoRealData;
  const LcmTypes types = Types(R"(
    struct encoders_t { int64_t utime; int32_t left_ticks_total, right_ticks_total; }
    struct imu_t { int64_t utime; double raw_acceleration[3], raw_angular_velocity[3], raw_orientation[3]; }
    struct laser_t { int64_t utime; int32_t num_ranges; float ranges[num_ranges], thetas[num_ranges];
                     int64_t times[num_ranges]; float intensities[num_ranges]; }
    struct pose_t { int64_t utime; float x, y, theta; })");
  const std::map<std::string, std::string> type_of{{"MAEBOT_ENCODERS", "encoders_t"},
                                                   {"MAEBOT_IMU", "imu_t"},
                                                   {"RPLIDAR_LASER", "laser_t"},
                                                   {"SLAM_POSE", "pose_t"}};
  const auto log = LogReader::Open(*data / "convex.log");
  ASSERT_TRUE(log.ok()) << log.error().message;
  for (const LogEntry& entry : log->entries()) {
    const auto message = log->Read(entry);
    ASSERT_TRUE(message.ok());
    ASSERT_EQ(types.TypeOf(*message), types.Find(type_of.at(log->ChannelOf(entry))));
    const auto json = DecodeToJson(types, *message);
    ASSERT_TRUE(json.ok()) << json.error().message;
    EXPECT_GT((*json)["utime"], 0);
  }
}

TEST(LcmDecode, KeepsBytesBinary) {
  fsmsg::frame_t frame{};
  frame.width_px = 3;
  frame.height_px = frame.camera = 1;
  frame.data = {0, 128, 255};
  frame.size = 3;
  const auto json = DecodeToJson(OurTypes(), Encode(frame));
  ASSERT_TRUE(json.ok()) << json.error().message;
  ASSERT_TRUE((*json)["data"].is_binary());
  EXPECT_EQ(static_cast<const Bytes&>((*json)["data"].get_binary()), frame.data);
}

void Append(Bytes& bytes, std::uint64_t value, int count) {
  for (int i = count; i-- > 0;) {
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

TEST(LcmDecode, KnowsEveryKindOfField) {
  const LcmTypes types = Types(R"(struct t { boolean yes; int16_t s; float f; byte b; string w[2];
                                             int8_t n; byte grid[n][2]; double none[n]; })");
  Bytes message;
  Append(message, static_cast<std::uint64_t>(types.Fingerprint(types.structs()[0])), 8);
  Append(message, 1, 1);
  Append(message, 0xFFFE, 2);
  Append(message, 0x3FC00000, 4);  // 1.5
  Append(message, 200, 1);
  for (const char letter : {'a', 'b'}) {
    Append(message, 2, 4);
    message.push_back(static_cast<std::uint8_t>(letter));
    message.push_back(0);
  }
  Append(message, 2, 1);
  Append(message, 0x01020304, 4);
  Append(message, 0x4000000000000000, 8);  // 2.0
  Append(message, 0x7FF0000000000000, 8);  // infinity
  const auto json = DecodeToJson(types, message);
  ASSERT_TRUE(json.ok()) << json.error().message;
  EXPECT_EQ((*json)["yes"], true);
  EXPECT_EQ((*json)["s"], -2);
  EXPECT_EQ((*json)["f"], 1.5);
  EXPECT_EQ((*json)["b"], 200);
  EXPECT_EQ((*json)["w"], Json({"a", "b"}));
  EXPECT_EQ((*json)["grid"][1], Json::binary({3, 4}));
  EXPECT_EQ((*json)["none"], Json({2.0, nullptr}));
}

// The generated code, guarded by Decode(), is the measure.
TEST(LcmDecode, RefusesWhatTheGeneratedCodeRefuses) {
  const LcmTypes types = OurTypes();
  const Bytes whole = Encode(Verdict());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const ByteView cut = ByteView(whole).first(size);
    EXPECT_FALSE(Decode<fsmsg::verdict_t>(cut).ok());
    const auto json = DecodeToJson(types, cut);
    ASSERT_FALSE(json.ok()) << size;
    EXPECT_EQ(json.error().code, ErrorCode::kFormat);
  }
  Bytes longer = whole;
  longer.push_back(0);
  EXPECT_THAT(DecodeToJson(types, longer).error().message, HasSubstr("1 bytes too many"));
  EXPECT_THAT(
      DecodeToJson(types, ByteView(whole).first(whole.size() - 1)).error().message,
      HasSubstr(
          "do not decode as fsmsg.verdict_t: dimensions.reason is a string of 1 bytes, and 0 are left"));
  EXPECT_TRUE(DecodeToJson(types, whole).ok());  // works again
}

// Each byte in turn made very small or large: the two agree on what can be decoded.
TEST(LcmDecode, AgreesWithTheGeneratedCodeOnChangedBytes) {
  const LcmTypes types = OurTypes();
  fsmsg::resend_request_t request{};
  request.channel = "FRAME_LEFT";
  request.pieces = {1, 2, 3};
  request.piece_count = 3;
  const Bytes whole = Encode(request);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int value : {0x00, 0x01, 0x80, 0xFF}) {
      Bytes changed = whole;
      changed[at] = static_cast<std::uint8_t>(value);
      EXPECT_EQ(DecodeToJson(types, changed).ok(), Decode<fsmsg::resend_request_t>(changed).ok()) << at;
    }
  }
}

}  // namespace
}  // namespace forgescan
