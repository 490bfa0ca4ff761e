// Two stations at once: nothing one says reaches the other, and what is killed or hangs in one is started
// again there alone.
#include "tests/line/two_stations.h"

#include <csignal>
#include <nlohmann/json.hpp>

#include "drivers/can/open_can_bus.h"

namespace forgescan::testing {
namespace {

using ::testing::HasSubstr;

TEST_F(TwoStations, HearNothingOfEachOther) {
  Up();
  for (const auto& ear : ears_) {
    EXPECT_THAT(ear->hashes, ::testing::ElementsAre(ear->hash)) << "a service of the other station was heard";
  }
  const auto status =
      RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status --json " + Folder(0).string());
  EXPECT_NE(status.exit_code, 0) << "there are no devices";
  const std::size_t begin = status.text.find("{\n"),
                    end = status.text.rfind("}\n");  // then the error's sentence
  ASSERT_LT(begin, end) << status.text;
  const auto json = nlohmann::json::parse(status.text.substr(begin, end + 1 - begin), nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << status.text;
  EXPECT_EQ(json["report"]["state"], "READY");
  EXPECT_EQ(json["robot"]["state"], "ERROR");
  EXPECT_EQ(json["report"]["restarts"], 0);
  EXPECT_GT(json["report"]["memory_mb"].get<double>(), 1.0);
  EXPECT_GE(json["report"]["peak_memory_mb"].get<double>(), json["report"]["memory_mb"].get<double>());
  Down();
}

TEST_F(TwoStations, TheirCanBusesAreApartToo) {
  const auto now_us = [] { return std::int64_t{0}; };
  auto north = OpenCanBus("udp:239.74.163.2:43113", now_us);
  auto near = OpenCanBus("udp:239.74.163.2:43113", now_us),
       far = OpenCanBus("udp:239.74.163.2:43114", now_us);
  ASSERT_TRUE(north.ok() && near.ok() && far.ok());
  int heard_near = 0, heard_far = 0;
  (*near)->AddHandler([&](const CanFrame&) { ++heard_near; });
  (*far)->AddHandler([&](const CanFrame&) { ++heard_far; });
  CanFrame frame;
  frame.id = 0x123;
  ASSERT_TRUE((*north)->Send(frame).ok());
  ASSERT_TRUE((*near)->Drain().ok());
  ASSERT_TRUE((*far)->Drain().ok());
  EXPECT_EQ(heard_near, 1);
  EXPECT_EQ(heard_far, 0);
}

TEST_F(TwoStations, WhatIsKilledOrHangsInOneIsStartedAgainThere) {
  Up();
  const pid_t dead = PidOfService(Folder(0), "fusion"), hung = PidOfService(Folder(0), "report");
  ASSERT_GT(dead, 0);
  ASSERT_GT(hung, 0);
  kill(dead, SIGKILL);
  kill(hung, SIGSTOP);
  EXPECT_TRUE(RunUntil([&] {
    return ears_[0]->sessions["fusion"].size() == 2 && ears_[0]->sessions["report"].size() == 2;
  })) << LogOf(0);
  EXPECT_THAT(LogOf(0), HasSubstr("fusion: was killed by signal 9"));
  EXPECT_THAT(LogOf(0), HasSubstr("report: has been silent for"));
  EXPECT_TRUE(RunUntil([&] { return LogOf(0).find("report: is ready, ") != std::string::npos; })) << LogOf(0);
  for (const auto& [service, sessions] : ears_[1]->sessions) {
    EXPECT_EQ(sessions.size(), 1u) << service;
  }
  Down();
}

TEST_F(TwoStations, AStationThatIsUpIsNotStartedTwice) {
  const auto status =
      RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station status " + Folder(0).string());
  EXPECT_THAT(status.text, HasSubstr("is not up"));
  Up();
  const auto again =
      RunCommand(std::string(FORGESCAN_BIN_DIR) + "/forgescan station up " + Folder(0).string());
  EXPECT_NE(again.exit_code, 0);
  EXPECT_THAT(again.text, HasSubstr("is up already"));
  Down();
}

}  // namespace
}  // namespace forgescan::testing
