#include "drivers/canopen/canopen.h"

#include <gtest/gtest.h>

#include "drivers/can/station_frames.h"
#include "drivers/canopen/canopen_node.h"

namespace forgescan::canopen {
namespace {

constexpr std::uint8_t kNode = 0x10;

TEST(Canopen, FramesAreThoseOfTheStationDbc) {
  EXPECT_EQ(HeartbeatFrame(kNode, NmtState::kOperational).id, station::RobotHeartbeat::kId);
  const auto emergency = station::RobotEmergency::Decode(EmergencyFrame(kNode, {0xFF01, 1, 0x00030002}));
  ASSERT_TRUE(emergency.ok());
  EXPECT_EQ(emergency->code, 0xFF01);
  EXPECT_EQ(emergency->detail, 0x00030002U);
  const auto start = station::NetworkCommand::Decode(NmtFrame(NmtCommand::kStart, kNode));
  ASSERT_TRUE(start.ok());
  EXPECT_EQ(start->node, kNode);
  const auto sdo = station::RobotSdoRequest::Decode(
      SdoFrame(kSdoRequestBase + kNode, {.kind = SdoMessage::Kind::kRead, .object = {0x2101, 0}}));
  ASSERT_TRUE(sdo.ok());
  EXPECT_EQ(sdo->index, 0x2101);
}

TEST(Canopen, ParsesOnlyItsOwnFrames) {
  EXPECT_EQ(ParseHeartbeat(HeartbeatFrame(kNode, NmtState::kBoot), kNode), NmtState::kBoot);
  EXPECT_FALSE(ParseHeartbeat(HeartbeatFrame(kNode, NmtState::kBoot), 0x11));
  EXPECT_FALSE(ParseHeartbeat({.id = kHeartbeatBase + kNode, .length = 1, .data = {77}}, kNode));
  EXPECT_TRUE(ParseNmt(NmtFrame(NmtCommand::kStop, 0), kNode));  // to all
  EXPECT_FALSE(ParseNmt(NmtFrame(NmtCommand::kStop, 0x11), kNode));
  EXPECT_FALSE(ParseEmergency({.id = kEmergencyBase + kNode, .length = 7}, kNode));
}

class NodeTest : public testing::Test {
 protected:
  SdoMessage Ask(const SdoMessage& request) {
    const auto frames = node_.OnFrame(SdoFrame(kSdoRequestBase + kNode, request));
    EXPECT_EQ(frames.size(), 1U);
    const auto answer = ParseSdoAnswer(frames.at(0), kNode);
    EXPECT_TRUE(answer);
    return answer.value_or(SdoMessage{});
  }

  CanopenNode node_{kNode};
};

TEST_F(NodeTest, BootsStartsStopsAndBeats) {
  EXPECT_EQ(node_.Step(0).at(0).data[0], 0);  // boot message
  EXPECT_EQ(node_.state(), NmtState::kPreOperational);
  EXPECT_TRUE(node_.OnFrame(NmtFrame(NmtCommand::kStart, kNode)).empty());
  EXPECT_TRUE(node_.operational());
  EXPECT_TRUE(node_.Step(kHeartbeatPeriod_us - 1).empty());
  EXPECT_EQ(node_.Step(kHeartbeatPeriod_us).at(0).data[0], 5);
  node_.OnFrame(NmtFrame(NmtCommand::kStop, kNode));
  EXPECT_EQ(node_.state(), NmtState::kStopped);
  EXPECT_TRUE(node_.OnFrame(SdoFrame(kSdoRequestBase + kNode, {})).empty());
  node_.OnFrame(NmtFrame(NmtCommand::kResetNode, 0));
  EXPECT_EQ(node_.Step(1).at(0).data[0], 0);
}

TEST_F(NodeTest, ServesItsObjectsByExpeditedSdo) {
  node_.SetObject({0x2100, 0}, {10, 2});
  node_.SetObject({0x2000, 1}, {1, 4, true});
  const SdoMessage read = Ask({.kind = SdoMessage::Kind::kRead, .object = {0x2100, 0}});
  EXPECT_EQ(read.value, 10U);
  EXPECT_EQ(read.bytes, 2);
  EXPECT_EQ(Ask({.kind = SdoMessage::Kind::kWrite, .object = {0x2000, 1}, .value = 7}).kind,
            SdoMessage::Kind::kWriteAnswer);
  EXPECT_EQ(node_.Object({0x2000, 1}), 7U);
}

TEST_F(NodeTest, AbortsWhatItCannotDo) {
  node_.SetObject({0x2100, 0}, {10, 2});
  node_.SetObject({0x2000, 1}, {1, 4, true});
  EXPECT_EQ(Ask({.kind = SdoMessage::Kind::kRead, .object = {0x3000, 0}}).value, kAbortNoObject);
  EXPECT_EQ(Ask({.kind = SdoMessage::Kind::kWrite, .object = {0x2100, 0}, .bytes = 2}).value, kAbortReadOnly);
  EXPECT_EQ(Ask({.kind = SdoMessage::Kind::kWrite, .object = {0x2000, 1}, .bytes = 1}).value,
            kAbortWrongLength);
  CanFrame segmented = SdoFrame(kSdoRequestBase + kNode, {});
  segmented.data[0] = 0x21;
  EXPECT_EQ(ParseSdoAnswer(node_.OnFrame(segmented).at(0), kNode)->value, kAbortUnknownCommand);
}

}  // namespace
}  // namespace forgescan::canopen
