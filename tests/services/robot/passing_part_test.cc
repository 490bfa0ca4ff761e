// A part that was there and left must end with a verdict, whatever the robot was doing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/robot/robot_machine.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

LinePart InPlace(std::uint32_t part, std::int64_t utime) {
  LinePart line;
  line.utime = utime;
  line.part = part;
  line.in_place = line.clamped = line.running = true;
  return line;
}

LinePart Left(std::uint32_t part, std::int64_t utime) {
  LinePart line = InPlace(part, utime);
  line.in_place = line.clamped = false;
  return line;
}

TEST(PassingPart, WithoutARobotItIsNamedAndNotInspected) {
  RobotMachine machine{RobotConfig{}};
  EXPECT_TRUE(machine.OnPart(InPlace(7, 1000), 1000).empty());
  const auto actions = machine.OnPart(Left(7, 2000), 2000);
  ASSERT_EQ(actions.size(), 2u);
  EXPECT_EQ(std::get<PartStarted>(actions[0]).part, 7);
  const auto& finished = std::get<ScanFinished>(actions[1]);
  EXPECT_EQ(finished.part, 7);
  EXPECT_EQ(finished.start_utime, 1000);
  EXPECT_THAT(finished.reason, HasSubstr("left before the robot could begin"));
}

TEST(PassingPart, TheNextPartMayComeWithoutAGap) {
  RobotMachine machine{RobotConfig{}};
  EXPECT_TRUE(machine.OnPart(InPlace(7, 1000), 1000).empty());
  const auto actions = machine.OnPart(InPlace(8, 2000), 2000);
  ASSERT_EQ(actions.size(), 2u);
  EXPECT_EQ(std::get<ScanFinished>(actions[1]).part, 7);
}

TEST(PassingPart, IsToldOnce) {
  RobotMachine machine{RobotConfig{}};
  machine.OnPart(InPlace(7, 1000), 1000);
  EXPECT_EQ(machine.OnPart(Left(7, 2000), 2000).size(), 2u);
  EXPECT_TRUE(machine.OnPart(Left(7, 2100), 2100).empty());
}

TEST(PassingPart, TheNextPartMayHaveTheSameNumber) {
  RobotMachine machine{RobotConfig{}};
  machine.OnPart(InPlace(7, 1000), 1000);
  machine.OnPart(Left(7, 2000), 2000);
  EXPECT_TRUE(machine.OnPart(InPlace(7, 3000), 3000).empty());
  const auto actions = machine.OnPart(Left(7, 4000), 4000);
  ASSERT_EQ(actions.size(), 2u);
  EXPECT_EQ(std::get<PartStarted>(actions[0]).utime, 3000);
  EXPECT_EQ(std::get<ScanFinished>(actions[1]).part, 7);
}

TEST(PassingPart, ANumberThatMessagesCannotCarryIsNamed) {
  for (const std::uint32_t part : {0u, 1u << 31}) {
    RobotMachine machine{RobotConfig{}};
    for (int time = 1000; time < 5000; time += 2000) {  // twice: the line may not count at all
      const auto actions = machine.OnPart(InPlace(part, time), time);
      ASSERT_EQ(actions.size(), 1u) << part;
      EXPECT_THAT(std::get<RobotNote>(actions[0]).text, HasSubstr(std::to_string(part) + ": not inspected"));
      EXPECT_TRUE(machine.OnPart(InPlace(part, time + 500), time + 500).empty());
      EXPECT_TRUE(machine.OnPart(Left(part, time + 1000), time + 1000).empty());
    }
    EXPECT_TRUE(machine.OnPart(InPlace(7, 6000), 6000).empty());
    EXPECT_EQ(machine.OnPart(Left(7, 7000), 7000).size(), 2u);  // works again
  }
}

}  // namespace
}  // namespace forgescan
