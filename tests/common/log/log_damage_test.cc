// Every kind of damage a log can take, at many places: each undamaged event is found with equal bytes, the
// damage is reported, and nothing is invented.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>

#include "services/common/log/log_reader.h"
#include "tests/common/log/synthetic_log.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Random = std::mt19937_64;

const SyntheticEvent& AnyEvent(const SyntheticLog& log, Random& random) {
  return log.events[random() % log.events.size()];
}

void Put(SyntheticLog& log, std::uint64_t at, std::uint32_t value) {
  Bytes bytes;
  AppendBigEndian(bytes, value);
  std::copy(bytes.begin(), bytes.end(), log.bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

void FlipABit(SyntheticLog& log, Random& random) {
  const SyntheticEvent& event = AnyEvent(log, random);
  if (!event.message.empty()) {
    const std::uint64_t at = event.message_offset() + random() % event.message.size();
    log.bytes[at] ^= static_cast<std::uint8_t>(1 << (random() % 8));
  }
}
void SpoilSyncWord(SyntheticLog& log, Random& random) {
  Put(log, AnyEvent(log, random).offset, static_cast<std::uint32_t>(random()));
}
void ChangeLength(SyntheticLog& log, Random& random) {
  const SyntheticEvent& event = AnyEvent(log, random);
  Put(log, event.offset + 24, static_cast<std::uint32_t>(random() % (2 * event.message.size() + 500)));
}
void ChangeLengthByALot(SyntheticLog& log, Random& random) {
  Put(log, AnyEvent(log, random).offset + 24, static_cast<std::uint32_t>(random() % 200'000));
}
void MakeLengthHuge(SyntheticLog& log, Random& random) {
  const auto length = random() % 2 == 0 ? 1'000'000 + random() % 60'000'000 : random();
  Put(log, AnyEvent(log, random).offset + 24, static_cast<std::uint32_t>(length));
}
void ChangeChannelLength(SyntheticLog& log, Random& random) {
  Put(log, AnyEvent(log, random).offset + 20, static_cast<std::uint32_t>(random() % 90));
}
void CutAHole(SyntheticLog& log, Random& random) {
  const std::uint64_t from = random() % log.bytes.size();
  log.Cut(from, from + 1 + random() % 10'000);
}
void CutTheTail(SyntheticLog& log, Random& random) { log.Cut(1 + random() % log.bytes.size(), SIZE_MAX); }
void AddZeros(SyntheticLog& log, Random& random) {
  log.bytes.resize(log.bytes.size() + 1 + random() % 10'000);
}
void CutTheTailAndAddZeros(SyntheticLog& log, Random& random) {
  CutTheTail(log, random);
  AddZeros(log, random);
}
void WriteZeros(SyntheticLog& log, Random& random) {
  const std::uint64_t from = random() % log.bytes.size();
  const std::uint64_t to = std::min<std::uint64_t>(log.bytes.size(), from + 1 + random() % 10'000);
  std::fill(log.bytes.begin() + static_cast<std::ptrdiff_t>(from),
            log.bytes.begin() + static_cast<std::ptrdiff_t>(to), std::uint8_t{0});
}
void WriteNoise(SyntheticLog& log, Random& random) {
  const std::uint64_t from = random() % log.bytes.size();
  const std::uint64_t to = std::min<std::uint64_t>(log.bytes.size(), from + 1 + random() % 10'000);
  for (std::uint64_t at = from; at < to; ++at) {
    log.bytes[at] = static_cast<std::uint8_t>(random());
  }
}
// What lcm-logger -a does after a crash: the numbers begin again at 0.
void AppendAfterACutTail(SyntheticLog& log, Random& random) {
  CutTheTail(log, random);
  for (const SyntheticEvent& event : MakeLog(random(), 40).events) {
    log.Append(event);
  }
}

struct Kind {
  const char* name;
  void (*damage)(SyntheticLog&, Random&);
};
constexpr Kind kKinds[] = {{"BitFlip", FlipABit},
                           {"BadSyncWord", SpoilSyncWord},
                           {"WrongLength", ChangeLength},
                           {"VeryWrongLength", ChangeLengthByALot},
                           {"HugeLength", MakeLengthHuge},
                           {"WrongChannelLength", ChangeChannelLength},
                           {"Hole", CutAHole},
                           {"ZerosInTheMiddle", WriteZeros},
                           {"Noise", WriteNoise},
                           {"TruncatedTail", CutTheTail},
                           {"ZerosAtTheEnd", AddZeros},
                           {"TruncatedTailWithZeros", CutTheTailAndAddZeros},
                           {"AppendedAfterTruncatedTail", AppendAfterACutTail}};
constexpr std::size_t kLocalKinds = 9;  // the first ones leave the rest of the log where it is

// The events whose headers are as they were written: if they fill the file, there is no damage to report.
bool HasDamageToReport(const SyntheticLog& log) {
  std::uint64_t at = 0;
  for (const SyntheticEvent& event : log.events) {
    const bool readable = event.offset == at && event.end() <= log.bytes.size() &&
                          std::equal(log.bytes.begin() + static_cast<std::ptrdiff_t>(event.offset + 20),
                                     log.bytes.begin() + static_cast<std::ptrdiff_t>(event.message_offset()),
                                     EncodedEvent(event).begin() + 20) &&
                          log.Holds(event, sizeof kLogSyncWord);
    at = readable ? event.end() : at;
  }
  return at != log.bytes.size();
}

// Events and damage cover the file, one behind the other.
void ExpectCovered(const LogReader& reader) {
  std::map<std::uint64_t, std::uint64_t> stretches;
  for (const LogEntry& entry : reader.entries()) {
    stretches[entry.offset] = reader.EndOf(entry) - entry.offset;
  }
  for (const LogDamage& damage : reader.damage()) {
    EXPECT_TRUE(stretches.try_emplace(damage.offset, damage.bytes).second);
    EXPECT_FALSE(damage.what.empty());
  }
  std::uint64_t at = 0;
  for (const auto& [offset, bytes] : stretches) {
    EXPECT_EQ(offset, at);
    at = offset + bytes;
  }
  EXPECT_EQ(at, reader.file_bytes());
}

class LogDamageTest : public ::testing::Test {
 protected:
  void TearDown() override { fs::remove(path_); }
  // The undamaged events that are missing.
  int Missing(const SyntheticLog& log, const LogReader& reader) const {
    std::map<std::uint64_t, const LogEntry*> found;
    for (const LogEntry& entry : reader.entries()) {
      found[entry.offset] = &entry;
    }
    int missing = 0;
    for (const SyntheticEvent& event : log.events) {
      if (!log.Holds(event)) continue;
      const auto entry = found.find(event.offset);
      const auto message =
          entry == found.end() ? Fail(ErrorCode::kNotFound, "none") : reader.Read(*entry->second);
      missing += message.ok() && *message == event.message && entry->second->number == event.number ? 0 : 1;
    }
    return missing;
  }
  // Events that nobody wrote; the last one before a damage may be an event that lost its end.
  int Invented(const SyntheticLog& log, const LogReader& reader) const {
    std::map<std::uint64_t, std::uint64_t> written;
    for (const SyntheticEvent& event : log.events) {
      written[event.offset] = event.end();
    }
    int invented = 0;
    for (const LogEntry& entry : reader.entries()) {
      const std::uint64_t end = reader.EndOf(entry);
      const auto same = written.find(entry.offset);
      const bool before_damage = std::any_of(reader.damage().begin(), reader.damage().end(),
                                             [end](const LogDamage& d) { return d.offset == end; });
      invented += (same != written.end() && same->second == end) || before_damage ? 0 : 1;
    }
    return invented;
  }
  const std::string path_ =
      fs::path(::testing::TempDir()) / ("log_damage_" + std::to_string(getpid()) + ".log");
};

class LogDamageKindTest : public LogDamageTest, public ::testing::WithParamInterface<Kind> {};

TEST_P(LogDamageKindTest, IsFoundAtAnyPlace) {
  const SyntheticLog whole = MakeLog(11, 120);
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    SyntheticLog log = whole;
    GetParam().damage(log, random);
    log.WriteTo(path_);
    const auto reader = LogReader::Open(path_);
    const bool any = std::any_of(log.events.begin(), log.events.end(),
                                 [&log](const SyntheticEvent& event) { return log.Holds(event); });
    if (!reader.ok()) {
      EXPECT_EQ(reader.error().code, ErrorCode::kFormat);
      EXPECT_FALSE(any) << reader.error().message;
      continue;
    }
    ExpectCovered(*reader);
    EXPECT_EQ(!reader->damage().empty(), HasDamageToReport(log));
    EXPECT_EQ(Missing(log, *reader), 0);
    EXPECT_EQ(Invented(log, *reader), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LogDamageKindTest, ::testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST_F(LogDamageTest, ManyInOneLogLoseNothingElse) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    SCOPED_TRACE(seed);
    Random random(1000 + seed);
    SyntheticLog log = MakeLog(seed, 600);
    for (int i = 0; i < 30; ++i) {
      kKinds[random() % kLocalKinds].damage(log, random);
    }
    log.WriteTo(path_);
    const auto reader = LogReader::Open(path_);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    ExpectCovered(*reader);
    EXPECT_EQ(Missing(log, *reader), 0);
  }
}

// A recording may hold a file that is itself a log.
TEST_F(LogDamageTest, ALogInAMessageIsNotTakenForEvents) {
  SyntheticLog log = MakeLog(21, 40);
  SyntheticEvent nested{40, 7, "RECORDED_FILE", MakeLog(22, 30).bytes, 0};
  log.Append(nested);
  log.bytes.resize(log.bytes.size() + 500);  // zeros behind it, so that it is not sound
  log.WriteTo(path_);
  const auto reader = LogReader::Open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->entries().size(), 41u);
  EXPECT_EQ(Missing(log, *reader), 0);
  ASSERT_EQ(reader->damage().size(), 1u);
  EXPECT_EQ(reader->damage()[0].what, "zeros");
}

TEST_F(LogDamageTest, IsNamed) {
  const SyntheticLog whole = MakeLog(31, 20);
  const auto what = [&](const auto& damage) {
    SyntheticLog log = whole;
    damage(log);
    log.WriteTo(path_);
    const auto reader = LogReader::Open(path_);
    return !reader.ok() || reader->damage().size() != 1 ? "not one damage" : reader->damage()[0].what;
  };
  const std::uint64_t tenth = whole.events[10].offset;
  EXPECT_EQ(what([](auto& log) { log.bytes.pop_back(); }), "an event that is cut off");
  EXPECT_EQ(what([&](auto& log) { log.bytes.resize(log.events[19].offset + 9); }),
            "an event that is cut off");
  EXPECT_EQ(what([&](auto& log) { Put(log, tenth, 1); }), "an event with a bad sync word");
  EXPECT_EQ(what([&](auto& log) { Put(log, tenth + 24, 0x7FFFFFFF); }),
            "an event with an impossible length or channel name");
  EXPECT_EQ(what([&](auto& log) { Put(log, tenth + 24, 100'000); }),
            "an event whose length does not fit what follows");
  EXPECT_EQ(what([](auto& log) { log.bytes.insert(log.bytes.end(), 50, 'x'); }), "bytes without a header");
}

}  // namespace
}  // namespace forgescan
