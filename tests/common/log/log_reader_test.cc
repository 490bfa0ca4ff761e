#include "services/common/log/log_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>

#include "services/common/bus/big_endian.h"
#include "tests/common/log/synthetic_log.h"
#include "tests/common/real_data.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

class LogReaderTest : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  Result<LogReader> Open(const SyntheticLog& log) const {
    log.WriteTo(path_);
    return LogReader::Open(path_);
  }
  ErrorCode CodeOf(const std::string& path) const {
    const auto reader = LogReader::Open(path);
    EXPECT_FALSE(reader.ok()) << path;
    EXPECT_NE(reader.error().message.find(path), std::string::npos) << reader.error().message;
    return reader.error().code;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("log_reader_" + std::to_string(getpid()));
  const std::string path_ = folder_ / "log";
};

TEST_F(LogReaderTest, StartsAndReadsEveryEvent) {
  const SyntheticLog log = MakeLog(1, 500);
  const auto reader = Open(log);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->file_bytes(), log.bytes.size());
  EXPECT_TRUE(reader->damage().empty());
  EXPECT_EQ(reader->channels().size(), 5u);
  ASSERT_EQ(reader->entries().size(), log.events.size());
  for (std::size_t i = 0; i < log.events.size(); ++i) {
    const LogEntry& entry = reader->entries()[i];
    EXPECT_EQ(entry.offset, log.events[i].offset);
    EXPECT_EQ(entry.number, log.events[i].number);
    EXPECT_EQ(entry.utime, log.events[i].utime);
    EXPECT_EQ(reader->ChannelOf(entry), log.events[i].channel);
    const auto message = reader->Read(entry);
    ASSERT_TRUE(message.ok()) << message.error().message;
    EXPECT_EQ(*message, log.events[i].message);
  }
}

TEST_F(LogReaderTest, ReadsARealLog) {
  const auto data = RealData("lcm-log");
  if (!data) GTEST_SKIP() << "lcm-log" << kNoRealData;
  const auto reader = LogReader::Open(*data / "convex.log");
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->entries().size(), 5714u);
  EXPECT_TRUE(reader->damage().empty());
  struct Channel {
    int events = 0;
    std::uint64_t bytes = 0;
    std::uint64_t fingerprint = 0;
    bool operator==(const Channel&) const = default;
  };
  std::map<std::string, Channel> channels;
  std::int64_t number = 0;
  for (const LogEntry& entry : reader->entries()) {
    EXPECT_EQ(entry.number, number++);
    Channel& channel = channels[reader->ChannelOf(entry)];
    const auto message = reader->Read(entry);
    ASSERT_TRUE(message.ok()) << message.error().message;
    ++channel.events;
    channel.bytes += message->size();
    const auto fingerprint = BigEndianAt<std::uint64_t>(*message, 0);
    EXPECT_TRUE(channel.fingerprint == 0 || channel.fingerprint == fingerprint);
    channel.fingerprint = fingerprint;
  }
  // As its README says.
  const std::map<std::string, Channel> expected{{"MAEBOT_ENCODERS", {3422, 82'128, 0x7d090bfb221d74f9}},
                                                {"MAEBOT_IMU", {1376, 121'088, 0xed966784146237ec}},
                                                {"RPLIDAR_LASER", {459, 2'746'580, 0x89dc5b879a5056cf}},
                                                {"SLAM_POSE", {457, 12'796, 0x1f317af1246276ac}}};
  EXPECT_EQ(channels.size(), expected.size());
  for (const auto& [name, channel] : expected) {
    EXPECT_TRUE(channels[name] == channel) << name;
  }
}

TEST_F(LogReaderTest, RefusesWhatIsNoLog) {
  EXPECT_EQ(CodeOf(folder_ / "none"), ErrorCode::kNotFound);
  EXPECT_EQ(CodeOf(folder_), ErrorCode::kIo);
  std::ofstream(folder_ / "empty").flush();
  EXPECT_EQ(CodeOf(folder_ / "empty"), ErrorCode::kFormat);
  std::ofstream(folder_ / "text") << "this is not a log, however long it may be made to look like one";
  EXPECT_EQ(CodeOf(folder_ / "text"), ErrorCode::kFormat);
  SyntheticLog header_only = MakeLog(2, 1);
  header_only.bytes.resize(kLogHeaderBytes - 1);
  header_only.WriteTo(path_);
  EXPECT_EQ(CodeOf(path_), ErrorCode::kFormat);
  EXPECT_TRUE(Open(MakeLog(2, 1)).ok());  // works again
}

TEST_F(LogReaderTest, DoesNotWaitForAPipe) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  EXPECT_EQ(CodeOf(folder_ / "pipe"), ErrorCode::kIo);
}

TEST_F(LogReaderTest, ReadsChannelsWithNamesInUtf8) {
  SyntheticLog log;
  const std::vector<std::string> names{"Kamera_ö", "A", "カメラ", "Kamera_ö", "é𝄞", "A", "Kamera_ö"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    log.Append({static_cast<std::int64_t>(i), 1, names[i], Bytes(100, 7), 0});
  }
  const auto reader = Open(log);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_TRUE(reader->damage().empty());
  ASSERT_EQ(reader->entries().size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(reader->ChannelOf(reader->entries()[i]), names[i]);
    EXPECT_TRUE(reader->Read(reader->entries()[i]).ok());
  }
}

TEST_F(LogReaderTest, OtherNamesAreDamage) {
  for (const std::string name :
       {"\xF6", "a\xC3", "\xC0\x80", "\xC2\x9B", "\xED\xA0\x80", "\xF5\x80\x80\x80", "a\n"}) {
    SyntheticLog log;
    log.Append({0, 1, "A", Bytes(100, 7), 0});
    log.Append({1, 1, name, Bytes(100, 7), 0});
    log.Append({2, 1, "A", Bytes(100, 7), 0});
    const auto reader = Open(log);
    ASSERT_TRUE(reader.ok()) << reader.error().message;
    EXPECT_EQ(reader->entries().size(), 2u);
    EXPECT_EQ(reader->damage().size(), 1u);
  }
}

TEST_F(LogReaderTest, NoticesAFileThatChanges) {
  SyntheticLog log = MakeLog(3, 50);
  const auto reader = Open(log);
  ASSERT_TRUE(reader.ok());
  const LogEntry first = reader->entries().front(), last = reader->entries().back();
  fs::resize_file(path_, last.offset + 5);
  const auto cut = reader->Read(last);
  ASSERT_FALSE(cut.ok());
  EXPECT_EQ(cut.error().code, ErrorCode::kIo);
  EXPECT_TRUE(reader->Read(first).ok());
  std::fstream(path_, std::ios::binary | std::ios::in | std::ios::out) << "other bytes";
  const auto changed = reader->Read(first);
  ASSERT_FALSE(changed.ok());
  EXPECT_EQ(changed.error().code, ErrorCode::kIo);
}

TEST_F(LogReaderTest, MovesWithItsFile) {
  const SyntheticLog log = MakeLog(4, 10);
  auto opened = Open(log);
  ASSERT_TRUE(opened.ok());
  LogReader reader = std::move(*opened);
  EXPECT_TRUE(reader.Read(reader.entries()[3]).ok());
  auto other = LogReader::Open(path_);
  ASSERT_TRUE(other.ok());
  reader = std::move(*other);
  EXPECT_EQ(*reader.Read(reader.entries()[3]), log.events[3].message);
}

// A power cut leaves blocks of zeros. As long as a real recording; sparse, so that it costs no disk.
TEST_F(LogReaderTest, PassesAGigabyteOfZeros) {
  SyntheticLog log = MakeLog(5, 20);
  log.WriteTo(path_);
  fs::resize_file(path_, std::uintmax_t{1} << 30);
  const auto reader = LogReader::Open(path_);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_EQ(reader->entries().size(), 20u);
  ASSERT_EQ(reader->damage().size(), 1u);
  EXPECT_EQ(reader->damage()[0].offset, log.bytes.size());
  EXPECT_EQ(reader->damage()[0].bytes, (std::uint64_t{1} << 30) - log.bytes.size());
  EXPECT_EQ(reader->damage()[0].what, "zeros");
}

TEST_F(LogReaderTest, PassesManySyncWordsAndManyHeaders) {
  SyntheticLog log = MakeLog(6, 20);
  const std::size_t good = log.bytes.size();
  while (log.bytes.size() < 32 << 20) {
    AppendBigEndian(log.bytes, kLogSyncWord);
  }
  // Each of these claims to reach far, and nothing is there.
  const Bytes header = EncodedEvent({-5, 0, "FAR", Bytes(3'000'000), 0});
  while (log.bytes.size() < 40 << 20) {
    log.bytes.insert(log.bytes.end(), header.begin(), header.begin() + kLogHeaderBytes + 3);
  }
  const auto reader = Open(log);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  ASSERT_GE(reader->entries().size(), 20u);
  EXPECT_EQ(reader->entries()[19].offset, log.events[19].offset);
  ASSERT_FALSE(reader->damage().empty());
  EXPECT_EQ(reader->damage()[0].offset, good);
}

// Each is followed by junk and may lie between the one before it and the last two; where it ends depends on
// all behind it. That has taken the square of their number, a minute for these. 10 s: many times what it
// takes.
TEST_F(LogReaderTest, PassesManyEventsWithFallingNumbersAndJunkBehindThem) {
  constexpr int kEvents = 40'000;
  SyntheticLog log;
  for (int i = 0; i < kEvents; ++i) {
    log.Append({kEvents - i, 1, "A", Bytes(3, 7), 0});
    log.bytes.push_back(0x55);
  }
  log.Append({900'000, 1, "A", Bytes(3, 7), 0});
  log.Append({900'001, 1, "A", Bytes(3, 7), 0});
  const auto start = std::chrono::steady_clock::now();
  const auto reader = Open(log);
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
  EXPECT_GT(reader->entries().size(), kEvents / 2U);
}

}  // namespace
}  // namespace forgescan
