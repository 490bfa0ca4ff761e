// A recording damaged at a hundred places in each way: check says so, and repair keeps every undamaged event.
#include "tools/forgescan/log/log_repair.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "services/common/log/log_reader.h"
#include "tests/tools/forgescan/test_recording.h"
#include "tools/forgescan/log/log_check.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Random = std::mt19937_64;

struct Place {
  std::uint64_t begin = 0, end = 0;  // of an event in the file
};

void Overwrite(Bytes& file, std::uint64_t at, std::uint64_t count, Random& random) {
  for (std::uint64_t i = at; i < std::min<std::uint64_t>(file.size(), at + count); ++i) {
    file[i] = static_cast<std::uint8_t>(random());
  }
}

// Each changes the file; `place` is an event of it.
void FlipABit(Bytes& file, Place place, Random& random) {
  file[place.end - 1 - random() % 30] ^= static_cast<std::uint8_t>(1 << random() % 8);
}
void SpoilSyncWord(Bytes& file, Place place, Random& random) { Overwrite(file, place.begin, 4, random); }
void SpoilLength(Bytes& file, Place place, Random& random) { Overwrite(file, place.begin + 26, 2, random); }
void MakeLengthHuge(Bytes& file, Place place, Random& /*random*/) { file[place.begin + 24] = 0x03; }
void CutAHole(Bytes& file, Place place, Random& random) {
  const auto from = file.begin() + static_cast<std::ptrdiff_t>(place.begin + 5 + random() % 20);
  file.erase(from, std::min(file.end(), from + static_cast<std::ptrdiff_t>(1 + random() % 3000)));
}
void CutTheTail(Bytes& file, Place place, Random& random) {
  file.resize(place.begin + 1 + random() % (place.end - place.begin - 1));
}
void EndWithZeros(Bytes& file, Place place, Random& random) {
  CutTheTail(file, place, random);
  file.resize(file.size() + 4096);
}
void WriteZeros(Bytes& file, Place place, Random& random) {
  const std::uint64_t end = std::min<std::uint64_t>(file.size(), place.begin + 1 + random() % 3000);
  std::fill(file.begin() + static_cast<std::ptrdiff_t>(place.begin),
            file.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{0});
}

struct Kind {
  const char* name;
  void (*damage)(Bytes&, Place, Random&);
};
constexpr Kind kKinds[] = {{"BitFlip", FlipABit},
                           {"BadSyncWord", SpoilSyncWord},
                           {"WrongLength", SpoilLength},
                           {"HugeLength", MakeLengthHuge},
                           {"Hole", CutAHole},
                           {"TruncatedTail", CutTheTail},
                           {"ZerosAtTheEnd", EndWithZeros},
                           {"ZerosInTheMiddle", WriteZeros}};

class LogRepair : public ::testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    fs::create_directories(folder_);
    TestRecording::Make().WriteTo(folder_ / "whole.log");
    std::ifstream file(folder_ / "whole.log", std::ios::binary);
    whole_.assign(std::istreambuf_iterator<char>(file), {});
  }
  void TearDown() override { fs::remove_all(folder_); }

  // How many findings there are.
  std::size_t Findings(const char* name) const {
    const auto recording = OpenRecording(folder_ / name);
    EXPECT_TRUE(recording.ok());
    const auto findings = recording.ok() ? CheckLog(*recording) : recording.error();
    EXPECT_TRUE(findings.ok());
    return findings.ok() ? findings->size() : 0;
  }
  // Of the messages, all of them different, that are still undivided and unchanged in the file.
  std::vector<Bytes> Undamaged(const Bytes& file, const LogReader& whole) const {
    std::vector<Bytes> messages;
    for (const LogEntry& entry : whole.entries()) {
      const auto begin = whole_.begin() + static_cast<std::ptrdiff_t>(entry.offset);
      const auto end = begin + static_cast<std::ptrdiff_t>(whole.EndOf(entry) - entry.offset);
      if (whole.ChannelOf(entry) != kRecordingClosed.name &&
          std::search(file.begin(), file.end(), begin, end) != file.end()) {
        messages.push_back(*whole.Read(entry));
      }
    }
    return messages;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("log_repair_" + std::to_string(getpid()));
  Bytes whole_;
};

TEST_P(LogRepair, KeepsEveryUndamagedEvent) {
  const auto whole = LogReader::Open(folder_ / "whole.log");
  ASSERT_TRUE(whole.ok());
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const LogEntry& entry = whole->entries()[1 + random() % (whole->entries().size() - 2)];
    Bytes file = whole_;
    GetParam().damage(file, {entry.offset, whole->EndOf(entry)}, random);
    if (file == whole_) continue;
    std::ofstream(folder_ / "a.log", std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
    EXPECT_GT(Findings("a.log"), 0u);
    fs::remove(folder_ / "b.log");
    ASSERT_TRUE(RepairLog(folder_ / "a.log", folder_ / "b.log").ok());
    const auto repaired = LogReader::Open(folder_ / "b.log");
    ASSERT_TRUE(repaired.ok());
    EXPECT_TRUE(repaired->damage().empty());
    std::vector<Bytes> messages;
    for (const LogEntry& kept : repaired->entries()) {
      messages.push_back(*repaired->Read(kept));
    }
    for (const Bytes& message : Undamaged(file, *whole)) {
      EXPECT_NE(std::find(messages.begin(), messages.end(), message), messages.end());
    }
    EXPECT_GT(Findings("b.log"), 0u);  // whole, but not complete
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LogRepair, ::testing::ValuesIn(kKinds),
                         [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace
}  // namespace forgescan
