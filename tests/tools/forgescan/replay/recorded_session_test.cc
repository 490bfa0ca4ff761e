#include "tools/forgescan/replay/recorded_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/tools/forgescan/replay/written_recording.h"

namespace forgescan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
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

TEST(RecordedSession, AWrongBitInATimeIsNamedAndTheNeighboursTimeTaken) {
  const TestFolder folder;
  for (const std::size_t wrong : {0, 2, 4}) {  // of: opening, three messages, closing
    const std::string path = folder / (std::to_string(wrong) + ".lcmlog");
    WrittenRecording recording(path);
    for (int i = 1; i <= 3; ++i) {
      recording.Stream(kPartArrived, Arrived(i, 10 * i), i);
    }
    recording.CloseAfter([wrong](auto& events) { events[wrong].utime ^= std::int64_t{1} << 50; });
    const auto session = RecordedSession::Open({path});
    ASSERT_TRUE(session.ok()) << session.error().message;
    EXPECT_THAT(session->findings(), ElementsAre(HasSubstr(fmt::format("event {}: its time", wrong))));
    EXPECT_THAT(TimesAfter(*session), ElementsAre(10, wrong == 2 ? 10 : 20, 30));
  }
}

TEST(RecordedSession, ALongSilenceIsNoWrongTime) {
  const TestFolder folder;
  WrittenRecording recording(folder / "one.lcmlog");
  recording.Stream(kPartArrived, Arrived(1, 10), 1);
  recording.Stream(kPartArrived, Arrived(2, 3'600'000'000), 2);
  recording.Close();
  const auto session = RecordedSession::Open({folder / "one.lcmlog"});
  ASSERT_TRUE(session.ok()) << session.error().message;
  EXPECT_THAT(session->findings(), IsEmpty());
  EXPECT_THAT(TimesAfter(*session), ElementsAre(10, 3'600'000'000));
}

TEST(RecordedSession, HoldsWhatThereIsAgainstWhatTheRecordingSaysOfItself) {
  const TestFolder folder;
  WrittenRecording lacking(folder / "lacking.lcmlog"), changed(folder / "changed.lcmlog");
  for (WrittenRecording* recording : {&lacking, &changed}) {
    recording->File("station.toml", "a = 1");
    recording->Stream(kPartArrived, Arrived(1, 10), 1);
  }
  lacking.CloseAfter([](auto& events) { events.erase(events.begin() + 2); });
  const auto less = RecordedSession::Open({folder / "lacking.lcmlog"});
  ASSERT_TRUE(less.ok()) << less.error().message;
  EXPECT_THAT(less->findings(), ElementsAre(HasSubstr("PART_ARRIVED the closing event counts 1 events")));
  changed.CloseAfter([](auto& events) { events[1].message.back() ^= 1; });
  const auto other = RecordedSession::Open({folder / "changed.lcmlog"});
  ASSERT_TRUE(other.ok()) << other.error().message;
  EXPECT_THAT(other->findings(), ::testing::Contains(HasSubstr("station.toml has the CRC-32")));
}

TEST(RecordedSession, RefusesAMessageThatTwoRecordingsHold) {
  const TestFolder folder;
  for (const char* name : {"a.lcmlog", "b.lcmlog"}) {
    WrittenRecording recording(folder / name);
    recording.Stream(kPartArrived, Arrived(1, 10), 7);
    recording.Close();
  }
  const auto twice = RecordedSession::Open({folder / "a.lcmlog", folder / "b.lcmlog"});
  ASSERT_FALSE(twice.ok());
  EXPECT_THAT(twice.error().message, HasSubstr("hold the same message, PART_ARRIVED 7"));
}

TEST(RecordedSession, NamesWhatIsNotWhole) {
  const TestFolder folder;
  {
    WrittenRecording recording(folder / "open.lcmlog");
    recording.Stream(kPartArrived, Arrived(1, 10), 1);
  }
  const auto unclosed = RecordedSession::Open({folder / "open.lcmlog.part"});
  ASSERT_TRUE(unclosed.ok()) << unclosed.error().message;
  EXPECT_THAT(unclosed->findings(), ElementsAre(HasSubstr("RECORDING_CLOSED is missing")));

  WrittenRecording recording(folder / "gap.lcmlog");
  recording.Stream(kPartArrived, Arrived(1, 10), 4);
  recording.Stream(kPartArrived, Arrived(1, 20), 9);
  recording.Close({{"PART_ARRIVED", kSession, 5, 6, "given up"}});
  const auto gap = RecordedSession::Open({folder / "gap.lcmlog"});
  ASSERT_TRUE(gap.ok()) << gap.error().message;
  EXPECT_THAT(gap->findings(),
              ElementsAre(HasSubstr("PART_ARRIVED the closing event names a gap: sequence 5 to 6")));
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
