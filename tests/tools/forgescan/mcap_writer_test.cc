#include "tools/forgescan/log/mcap_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libdeflate.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "services/common/base64.h"
#include "services/common/bus/bus.h"
#include "services/common/new_file.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

std::uint64_t Number(const std::string& bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) {
    value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
  }
  return value;
}

struct Record {
  int op = 0;
  std::size_t at = 0;  // of its content
  std::string content;
};

std::vector<Record> Records(const std::string& bytes, std::size_t from, std::size_t to) {
  std::vector<Record> records;
  while (from < to) {
    const std::size_t size = Number(bytes, from + 1, 8);
    records.push_back({static_cast<unsigned char>(bytes.at(from)), from + 9, bytes.substr(from + 9, size)});
    from += 9 + size;
  }
  EXPECT_EQ(from, to);
  return records;
}

std::uint32_t Crc(const std::string& bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

class McapWriterTest : public ::testing::Test {
 protected:
  void TearDown() override {
    fs::remove(path_);
    fs::remove(path_ + StagedEnding());
  }
  // On two channels, in two chunks.
  void WriteFourMessages() const {
    auto writer = McapWriter::Create(path_);
    ASSERT_TRUE(writer.ok()) << writer.error().message;
    const auto schema = writer->AddSchema("type", R"({"type":"object"})");
    const auto a = writer->AddChannel(*schema, "A"), b = writer->AddChannel(*schema, "B");
    ASSERT_TRUE(a.ok() && b.ok());
    const std::string large(3'000'000, ' ');
    for (std::uint32_t i = 0; i < 4; ++i) {
      ASSERT_TRUE(writer->Write({i % 2 == 0 ? *a : *b, i, 1000 - i, i}, "{}" + large).ok());
    }
    ASSERT_TRUE(writer->Close().ok());
  }
  std::string FileBytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  const std::string path_ = fs::path(::testing::TempDir()) / ("mcap_" + std::to_string(getpid()));
};

// Read back by the letter of the specification.
TEST_F(McapWriterTest, StartsAndFollowsTheSpecification) {
  WriteFourMessages();
  const std::string bytes = FileBytes(), magic("\x89MCAP0\r\n", 8);
  ASSERT_EQ(bytes.substr(0, 8), magic);
  ASSERT_EQ(bytes.substr(bytes.size() - 8), magic);
  const std::vector<Record> records = Records(bytes, 8, bytes.size() - 8);
  std::map<int, int> counts;
  for (const Record& record : records) {
    ++counts[record.op];
  }
  EXPECT_EQ(counts, (std::map<int, int>{
                        {1, 1}, {2, 1}, {3, 1}, {4, 2}, {6, 2}, {7, 4}, {8, 2}, {11, 1}, {14, 4}, {15, 1}}));
  for (const Record& record : records) {
    if (record.op == 15) {  // of all that is before it
      EXPECT_EQ(Number(record.content, 0, 4), Crc(bytes.substr(0, record.at - 9)));
    } else if (record.op == 6) {
      const std::string inner = record.content.substr(40);
      EXPECT_EQ(Number(record.content, 24, 4), Crc(inner));
      EXPECT_EQ(Number(record.content, 16, 8), inner.size());
    } else if (record.op == 2) {
      const std::uint64_t summary = Number(record.content, 0, 8);
      EXPECT_EQ(Number(record.content, 16, 4), Crc(bytes.substr(summary, record.at + 16 - summary)));
    } else if (record.op == 11) {
      EXPECT_EQ(Number(record.content, 0, 8), 4u);
      EXPECT_EQ(Number(record.content, 26, 8), 997u);   // first time
      EXPECT_EQ(Number(record.content, 34, 8), 1000u);  // last time
    } else if (record.op == 8) {
      const std::uint64_t chunk = Number(record.content, 16, 8);
      EXPECT_EQ(bytes[chunk], 6);
      EXPECT_EQ(Number(record.content, 24, 8), 9 + Number(bytes, chunk + 1, 8));
    }
  }
}

// What a viewer jumps by: summary offset to chunk index, to message index, to message.
TEST_F(McapWriterTest, IndicesLeadToTheMessages) {
  WriteFourMessages();
  const std::string bytes = FileBytes();
  std::map<std::uint64_t, std::uint64_t> channels;  // by log time
  for (const Record& summary : Records(bytes, 8, bytes.size() - 8)) {
    if (summary.op != 14) continue;
    const std::uint64_t group = Number(summary.content, 0, 1), at = Number(summary.content, 1, 8);
    for (const Record& record : Records(bytes, at, at + Number(summary.content, 9, 8))) {
      EXPECT_EQ(record.op, static_cast<int>(group));
      if (record.op != 8) continue;
      const std::uint64_t messages = Number(record.content, 16, 8) + 9 + 40;  // behind the chunk's head
      constexpr std::size_t kMap = 36, kMapEntry = 10, kIndexEntry = 16;
      for (std::size_t entry = kMap; entry < kMap + Number(record.content, 32, 4); entry += kMapEntry) {
        const std::uint64_t channel = Number(record.content, entry, 2),
                            index = Number(record.content, entry + 2, 8);
        ASSERT_EQ(bytes.at(index), 7);
        EXPECT_EQ(Number(bytes, index + 9, 2), channel);
        for (std::size_t i = 0; i < Number(bytes, index + 11, 4); i += kIndexEntry) {
          const std::uint64_t time_ns = Number(bytes, index + 15 + i, 8),
                              message = messages + Number(bytes, index + 23 + i, 8);
          ASSERT_EQ(bytes.at(message), 5);
          EXPECT_EQ(Number(bytes, message + 9, 2), channel);
          EXPECT_EQ(Number(bytes, message + 15, 8), time_ns);
          channels[time_ns] = channel;
        }
      }
    }
  }
  EXPECT_EQ(channels, (std::map<std::uint64_t, std::uint64_t>{{997, 2}, {998, 1}, {999, 2}, {1000, 1}}));
}

TEST_F(McapWriterTest, AnEmptyFileIsValid) {
  auto writer = McapWriter::Create(path_);
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->Close().ok());
  const std::string bytes = FileBytes();
  EXPECT_EQ(Records(bytes, 8, bytes.size() - 8).size(),
            5u);  // header, data end, statistics, its offset, footer
}

TEST_F(McapWriterTest, NeverOverwritesAndLeavesNothingHalf) {
  {
    auto writer = McapWriter::Create(path_);
    ASSERT_TRUE(writer.ok());
    EXPECT_FALSE(McapWriter::Create(path_).ok());  // it is being written
  }
  EXPECT_FALSE(fs::exists(path_ + StagedEnding()));
  std::ofstream(path_) << "mine";
  const auto refused = McapWriter::Create(path_);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(FileBytes(), "mine");
  EXPECT_FALSE(McapWriter::Create(path_ + "/b").ok());
}

TEST_F(McapWriterTest, HasAtMost65535Schemas) {
  auto writer = McapWriter::Create(path_);
  ASSERT_TRUE(writer.ok());
  for (int i = 0; i < 65'535; ++i) {
    ASSERT_TRUE(writer->AddSchema("s", "{}").ok());
  }
  const auto refused = writer->AddSchema("s", "{}");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

// The examples of RFC 4648, section 10.
TEST(Base64, FollowsItsStandard) {
  const std::vector<std::pair<std::string, std::string>> examples{{"", ""},
                                                                  {"f", "Zg=="},
                                                                  {"fo", "Zm8="},
                                                                  {"foo", "Zm9v"},
                                                                  {"foob", "Zm9vYg=="},
                                                                  {"fooba", "Zm9vYmE="},
                                                                  {"foobar", "Zm9vYmFy"},
                                                                  {"\xFF\xFE\xFD", "//79"}};
  for (const auto& [bytes, text] : examples) {
    EXPECT_EQ(Base64(Bytes(bytes.begin(), bytes.end())), text);
  }
}

}  // namespace
}  // namespace forgescan
