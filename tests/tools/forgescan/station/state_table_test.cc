// The table of a station: what is known, what is not, and that it fits its width.
#include "tools/forgescan/station/state_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "services/common/bus/channels.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/bus/stream_hub.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using State = fsmsg::service_state_t;

constexpr std::int64_t kSecondUs = 1'000'000;

class StateTableTest : public ::testing::Test {
 protected:
  State Word(const std::string& name, std::int8_t state, std::int64_t session = 1) {
    State word{};
    word.utime = network_.NowUs();
    word.session = session;
    word.name = name;
    word.state = state;
    return word;
  }
  void Say(State word) {
    word.counter_count = static_cast<std::int32_t>(word.counters.size());
    ASSERT_TRUE(PublishState(speaker_, kServiceState, word).ok());
    network_.RunFor(10'000);
  }
  // Of the table's lines, that of the service.
  std::string LineOf(const std::string& service, const std::vector<TableRow>& rows, int width = 140) {
    std::istringstream lines(table_.Render(rows, width, false));
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(service)) {
        return line;
      }
    }
    return "";
  }
  static TableRow Row(const std::string& service) {
    TableRow row;
    row.service = service;
    return row;
  }

  SimNetwork network_;
  SimBus& speaker_ = network_.AddNode();
  StateTable table_{network_.AddNode()};
};

TEST_F(StateTableTest, WhatIsNotKnownIsADash) {
  const std::string line = LineOf("report", {Row("report")});
  EXPECT_THAT(line, HasSubstr("not heard"));
  EXPECT_THAT(line, ::testing::ContainsRegex("( +-){9}"));
  const auto json = nlohmann::json::parse(table_.Json({Row("report")}));
  EXPECT_TRUE(json["report"]["state"].is_null());
  EXPECT_TRUE(json["report"]["restarts"].is_null());
}

TEST_F(StateTableTest, ShowsStateRatesCountsAndCost) {
  State word = Word("camera_left", State::STATE_WORKING);
  word.messages_missing = 3;
  word.messages_resent = 14;
  word.messages_recovered = 15;
  word.text = "part 3 view 4";
  word.counters = {{"messages_received", 10}, {"messages_sent", 100}};
  Say(word);
  network_.RunFor(2 * kSecondUs - 10'000);
  word.utime = network_.NowUs();
  word.counters = {{"messages_received", 13}, {"messages_sent", 180}};
  Say(word);
  TableRow row = Row("camera_left");
  row.usage = Usage{12.4, 345.6, 401.2};
  row.restarts = 2;
  EXPECT_THAT(LineOf("camera_left", {row}),
              ::testing::MatchesRegex(
                  "camera_left +working +0\\.0 +12 +346 +401 +1\\.5 +40\\.0 +3 +14 +15 +2  part 3 view 4"));
  const auto json = nlohmann::json::parse(table_.Json({row}))["camera_left"];
  EXPECT_EQ(json["state"], "WORKING");
  EXPECT_EQ(json["out_per_s"], 40.0);
  EXPECT_EQ(json["peak_memory_mb"], 401.2);
  EXPECT_EQ(json["restarts"], 2);
  EXPECT_EQ(json["counters"]["messages_sent"], 180);
}

TEST_F(StateTableTest, ASilentServiceIsNotReady) {
  Say(Word("fusion", State::STATE_READY));
  EXPECT_TRUE(table_.AllReady({"fusion"}));
  EXPECT_FALSE(table_.AllReady({"fusion", "robot"}));
  network_.RunFor(4 * kSecondUs);
  EXPECT_FALSE(table_.AllReady({"fusion"}));
  EXPECT_THAT(LineOf("fusion", {Row("fusion")}), HasSubstr("SILENT"));
  Say(Word("fusion", State::STATE_READY));
  EXPECT_TRUE(table_.AllReady({"fusion"})) << "works again after the silence";
}

TEST_F(StateTableTest, FollowsAServiceStartedAnewOnAClockSetBack) {
  Say(Word("robot", State::STATE_READY, 2000));
  Say(Word("robot", State::STATE_STARTING, 1000));
  EXPECT_EQ(table_.states().at("robot").state, State::STATE_STARTING);
  Say(Word("robot", State::STATE_READY, 2000));  // a late word of the one before
  EXPECT_EQ(table_.states().at("robot").state, State::STATE_STARTING);
}

TEST_F(StateTableTest, FitsItsWidthAndShowsTheLastErrors) {
  State word = Word("reconstruction", State::STATE_DEGRADED);
  word.text = std::string(300, 'x');
  word.last_error = "part 12 view 3: 15 of 16 frames came within 30 s" + std::string(300, 'y');
  word.messages_missing = 12345;
  Say(word);
  for (const int width : {96, 100, 140, 200}) {
    const std::string text = table_.Render({Row("reconstruction"), Row("report")}, width, false);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_LE(line.size(), static_cast<std::size_t>(width)) << line;
    }
    EXPECT_THAT(text, HasSubstr("last errors\nreconstruction: part 12 view 3: 15 of 16 frames"));
  }
}

TEST_F(StateTableTest, ColoursOnlyOnRequest) {
  Say(Word("cooling", State::STATE_ERROR));
  EXPECT_THAT(table_.Render({Row("cooling")}, 100, false), Not(HasSubstr("\x1b[")));
  EXPECT_THAT(table_.Render({Row("cooling")}, 100, true), HasSubstr("\x1b[31mERROR"));
  TableRow row = Row("cooling");
  row.given_up = true;
  EXPECT_THAT(table_.Render({row}, 100, true), HasSubstr("GIVEN UP"));
}

TEST(ProcessUsage, KnowsOneselfAndNotTheDead) {
  ProcessUsage usage;
  const auto first = usage.Of(getpid(), 0);
  ASSERT_TRUE(first.has_value());
  EXPECT_FALSE(first->cpu_percent.has_value());
  EXPECT_GT(first->memory_mb, 1.0);
  EXPECT_GE(first->peak_memory_mb, first->memory_mb);
  {
    const std::vector<char> large(64 << 20, 'x');  // resident for a moment
    EXPECT_GT(usage.Of(getpid(), 0)->memory_mb, first->memory_mb + 50.0) << large.back();
  }
  const auto second = usage.Of(getpid(), kSecondUs);
  ASSERT_TRUE(second.has_value() && second->cpu_percent.has_value());
  EXPECT_GE(*second->cpu_percent, 0.0);
  EXPECT_GT(second->peak_memory_mb, second->memory_mb + 50.0) << "the moment is over, the peak stays";
  EXPECT_FALSE(usage.Of(0, kSecondUs).has_value());
  EXPECT_FALSE(usage.Of(-1, kSecondUs).has_value());
}

}  // namespace
}  // namespace forgescan
