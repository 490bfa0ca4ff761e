// station.dbc, the code written from it, and the reader of DBC.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "drivers/can/dbc.h"
#include "drivers/can/station_frames.h"

namespace forgescan {
namespace {

using testing::HasSubstr;

std::string Read(const std::string& path) {
  std::ifstream file(std::string(FORGESCAN_SOURCE_DIR "/") + path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

double StepOf(const SignalInfo& signal) { return signal.allowed.empty() ? signal.factor : 0; }

std::vector<double> LowestValues(const MessageInfo& info) {
  std::vector<double> values;
  for (const SignalInfo& signal : info.signals) {
    values.push_back(signal.allowed.empty() ? signal.min : signal.allowed.front());
  }
  return values;
}

// Through the table to a frame, through the struct and back: the same frame, and the value within half a
// step.
template <typename Message>
void RoundTrip(std::size_t index, double value) {
  const MessageInfo& info = Message::Info();
  std::vector<double> values = LowestValues(info);
  values[index] = value;
  const auto frame = EncodeSignals(info, values);
  ASSERT_TRUE(frame.ok()) << frame.error().message;
  const auto message = Message::Decode(*frame);
  ASSERT_TRUE(message.ok()) << message.error().message;
  const auto again = message->Encode();
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(*again, *frame) << info.name << "." << info.signals[index].name << " = " << value;
  const auto decoded = DecodeSignals(info, *frame);
  ASSERT_TRUE(decoded.ok());
  EXPECT_NEAR((*decoded)[index], value, info.signals[index].factor / 2) << info.signals[index].name;
}

template <typename Message>
void CheckMessage() {
  const MessageInfo& info = Message::Info();
  for (std::size_t i = 0; i < info.signals.size(); ++i) {
    const SignalInfo& signal = info.signals[i];
    if (signal.allowed.empty()) {
      RoundTrip<Message>(i, signal.min);
      RoundTrip<Message>(i, signal.max);
      RoundTrip<Message>(i, signal.max - StepOf(signal));
    }
    for (const int value : signal.allowed) {
      RoundTrip<Message>(i, value);
    }
    for (const double bad :
         {signal.max + 2 * signal.factor, signal.min - 2 * signal.factor, std::nan(""), HUGE_VAL}) {
      std::vector<double> values = LowestValues(info);
      values[i] = bad;
      EXPECT_FALSE(EncodeSignals(info, values).ok()) << info.name << "." << signal.name << " = " << bad;
    }
  }
  CanFrame other{.id = info.id, .length = static_cast<std::uint8_t>(info.length + 1)};
  EXPECT_FALSE(Message::Decode(other).ok());
  EXPECT_FALSE(Message::Decode({.id = info.id + 1, .length = info.length}).ok());
}

template <typename... Messages>
void CheckAll(std::type_identity<std::tuple<Messages...>>) {
  (CheckMessage<Messages>(), ...);
}

TEST(StationFrames, EverySignalComesBackAtItsEndsAndIsRefusedBeyondThem) {
  CheckAll(std::type_identity<station::AllMessages>());
}

TEST(StationFrames, BytesAreWhereTheProtocolHasThem) {
  station::RobotCommand command;
  command.seq = 0x1234;
  command.command = station::RobotCommand::Command::kGoView;
  command.path = 3;
  command.view = 0x0507;
  const auto frame = command.Encode();
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(frame->id, 0x210U);
  EXPECT_THAT(frame->data, testing::ElementsAre(0x34, 0x12, 2, 0, 3, 0, 7, 5));
}

TEST(StationFrames, ScaledValuesAreTheNearestDoubles) {
  station::RobotMotion motion;
  motion.body_degc = 30.3;
  EXPECT_EQ(station::RobotMotion::Decode(*motion.Encode())->body_degc, 30.3);
}

TEST(StationFrames, AValueBeyondItsRangeOnTheWireIsRefused) {
  CanFrame frame = *station::RobotStatus{}.Encode();
  frame.data[2] = 8;  // state 0..7
  const auto status = station::RobotStatus::Decode(frame);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("RobotStatus.state"));
}

TEST(StationFrames, TheTableIsTheOneWrittenFromTheDbc) {
  const auto dbc = ParseDbc(Read("drivers/can/station.dbc"));
  ASSERT_TRUE(dbc.ok()) << dbc.error().message;
  EXPECT_EQ(Read("drivers/can/station.md"), WriteFramesTable(*dbc))
      << "copy <build>/generated/drivers/can/station.md to drivers/can/";
}

TEST(Dbc, SaysWhichLineIsWrong) {
  const std::string head = "BO_ 5 M: 2 Host\n SG_ a : 0|8@1+ (1,0) [0|255] \"\" X\n";
  ASSERT_TRUE(ParseDbc(head).ok());
  const std::pair<const char*, const char*> wrong[] = {
      {" SG_ b : 7|8@1+ (1,0) [0|255] \"\" X\n", "overlap"},
      {" SG_ b : 9|8@1+ (1,0) [0|255] \"\" X\n", "leave the message"},
      {" SG_ b : 8|8@0+ (1,0) [0|255] \"\" X\n", "not a statement"},
      {" SG_ b : 8|8@1+ (1,0) [0|256] \"\" X\n", "does not fit"},
      {" SG_ b : 8|8@1+ (0,0) [0|1] \"\" X\n", "does not fit"},
      {" SG_ b : 8|8@1+ (1e999,0) [0|1] \"\" X\n", "number"},
      {"BO_ 5 N: 8 Host\n", "given twice"},
      {"VAL_ 5 c 1 \"x\" ;\n", "unknown signal"},
      {"VAL_ 5 a 300 \"x\" ;\n", "out of range"},
      {"CM_ BO_ 6 \"x\";\n", "unknown message"},
  };
  for (const auto& [line, why] : wrong) {
    const auto dbc = ParseDbc(head + line);
    ASSERT_FALSE(dbc.ok()) << line;
    EXPECT_THAT(dbc.error().message, testing::AllOf(HasSubstr("DBC line 3"), HasSubstr(why))) << line;
  }
  EXPECT_FALSE(ParseDbc("").ok());
}

}  // namespace
}  // namespace forgescan
