#include "tools/forgescan/replay/recorded_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::kSession;
using testing::TestFolder;
using testing::WrittenRecording;

fsmsg::part_arrived_t Arrived(int part, std::int64_t after_us) {
  fsmsg::part_arrived_t message{};
  message.utime = kSession + after_us;
  message.part = part;
  return message;
}

fsmsg::service_state_t State(const std::string& name, std::int64_t after_us) {
  fsmsg::service_state_t message{};
  message.utime = kSession + after_us;
  message.name = name;
  return message;
}

std::vector<std::int64_t> TimesAfter(const RecordedSession& session) {
  std::vector<std::int64_t> times;
  for (const RecordedEvent& event : session.events()) {
    times.push_back(event.utime - kSession);
  }
  return times;
}

TEST(RecordedSession, HoldsTheMessagesOfTheBusWithoutWhatTheRecorderAdded) {
  const TestFolder folder;
  WrittenRecording recording(folder / "one.lcmlog");
  recording.File("station.toml", "a = 1\n");
  const Bytes written = recording.Stream(kPartArrived, Arrived(1, 10), 1);
  recording.Close();
  const auto session = RecordedSession::Open({folder / "one.lcmlog"});
  ASSERT_TRUE(session.ok()) << session.error().message;
  ASSERT_EQ(session->events().size(), 1u);
  EXPECT_EQ(session->ChannelOf(session->events()[0]), "PART_ARRIVED");
  const auto read = session->Read(session->events()[0]);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(*read, written);
  const auto start = session->ReadStart(session->events()[0], 16);
  ASSERT_TRUE(start.ok()) << start.error().message;
  EXPECT_EQ(start->size(), 16u);
  EXPECT_EQ(session->opened().station, "test");
  ASSERT_EQ(session->files().size(), 1u);
  EXPECT_EQ(session->files()[0].name, "station.toml");
  EXPECT_TRUE(session->findings().empty());
  EXPECT_THAT(session->Where(session->events()[0]), HasSubstr("one.lcmlog, event 2 at byte "));
}

TEST(RecordedSession, JoinsOverlappingPartsInOrderOfTimeWithEachStateOnce) {
  const TestFolder folder;
  WrittenRecording first(folder / "1.lcmlog"), second(folder / "2.lcmlog");
  first.Stream(kPartArrived, Arrived(1, 10), 1);
  second.Stream(kPartArrived, Arrived(2, 30), 2);
  for (WrittenRecording* recording : {&first, &second}) {
    recording->State(kServiceState, State("robot", 40));
    recording->State(kServiceState, State("report", 40));
  }
  first.Stream(kPartArrived, Arrived(3, 50), 3);
  first.Close();
  second.Close();
  const auto session = RecordedSession::Open({folder / "2.lcmlog", folder / "1.lcmlog"});
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_THAT(TimesAfter(*session), ElementsAre(10, 30, 40, 40, 50));
  EXPECT_EQ(session->duration_us(), 40);
}

TEST(RecordedSession, TimeNeverGoesBack) {
  const TestFolder folder;
  WrittenRecording recording(folder / "one.lcmlog");
  recording.Stream(kPartArrived, Arrived(1, 50), 1);
  recording.Stream(kPartArrived, Arrived(2, 20), 2);
  recording.Close();
  const auto session = RecordedSession::Open({folder / "one.lcmlog"});
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_THAT(TimesAfter(*session), ElementsAre(50, 50));
}

TEST(RecordedSession, NamesWhatIsNotWhole) {
  const TestFolder folder;
  {
    WrittenRecording recording(folder / "open.lcmlog");
    recording.Stream(kPartArrived, Arrived(1, 10), 1);
  }
  const auto unclosed = RecordedSession::Open({folder / "open.lcmlog.part"});
  ASSERT_TRUE(unclosed.ok()) << unclosed.error().message;
  EXPECT_THAT(unclosed->findings(), ElementsAre(HasSubstr("was not closed")));

  WrittenRecording recording(folder / "gap.lcmlog");
  recording.Stream(kPartArrived, Arrived(1, 10), 4);
  recording.Stream(kPartArrived, Arrived(1, 20), 9);
  recording.Close({{"PART_ARRIVED", kSession, 5, 6, "given up"}});
  const auto gap = RecordedSession::Open({folder / "gap.lcmlog"});
  ASSERT_TRUE(gap.ok()) << gap.error().message;
  EXPECT_THAT(gap->findings(), ElementsAre(HasSubstr("PART_ARRIVED 5 to 6 are missing: given up")));
  EXPECT_EQ(gap->LostBetween("PART_ARRIVED", {kSession, 4}, {kSession, 9}), 2);
  EXPECT_EQ(gap->LostBetween("PART_ARRIVED", {kSession, 6}, {kSession, 9}), 0);
  EXPECT_EQ(gap->LostBetween("VIEW_READY", {kSession, 4}, {kSession, 9}), 0);
  EXPECT_EQ(gap->LostBetween("PART_ARRIVED", {1, 4}, {1, 9}), 0);
}

TEST(RecordedSession, RefusesWhatIsNoRecordingOrOfTwoStations) {
  const TestFolder folder;
  const auto none = RecordedSession::Open({folder / "none.lcmlog"});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);

  auto foreign = LogWriter::Create(folder / "foreign.lcmlog");
  ASSERT_TRUE(foreign.ok());
  ASSERT_TRUE(foreign->Write("POSE", kSession, Bytes{1, 2, 3}).ok());
  ASSERT_TRUE(foreign->Close().ok());
  const auto no_opening = RecordedSession::Open({folder / "foreign.lcmlog"});
  ASSERT_FALSE(no_opening.ok());
  EXPECT_THAT(no_opening.error().message, HasSubstr("it is not a recording of forgescan"));

  WrittenRecording a(folder / "a.lcmlog", "east"), b(folder / "b.lcmlog", "west");
  a.Close();
  b.Close();
  const auto stations = RecordedSession::Open({folder / "a.lcmlog", folder / "b.lcmlog"});
  ASSERT_FALSE(stations.ok());
  EXPECT_THAT(stations.error().message, HasSubstr("of station west"));

  WrittenRecording c(folder / "c.lcmlog"), d(folder / "d.lcmlog");
  c.File("pattern.toml", "1");
  d.File("pattern.toml", "2");
  c.Close();
  d.Close();
  const auto files = RecordedSession::Open({folder / "c.lcmlog", folder / "d.lcmlog"});
  ASSERT_FALSE(files.ok());
  EXPECT_THAT(files.error().message, HasSubstr("pattern.toml of"));
}

}  // namespace
}  // namespace forgescan
