// Holds lcmtypes/README.md, lcmtypes/*.lcm and the channel constants of the code together.
#include "services/common/bus/channel_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "services/common/log/message_definitions.h"

namespace {

namespace fs = std::filesystem;
const fs::path kSource = FORGESCAN_SOURCE_DIR;

std::string ReadAll(const fs::path& path) {
  std::ifstream stream(path);
  EXPECT_TRUE(stream.is_open()) << path;
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

struct Row {
  std::string type;
  std::string kind;
  bool operator==(const Row&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Row& row) { return out << row.type << " " << row.kind; }

std::map<std::string, Row> RowsOfReadme() {
  const std::string text = ReadAll(kSource / "lcmtypes/README.md");
  const std::regex row(R"(\| `([A-Z_]+)` \| `([a-z0-9_]+)` \|.*\| (\w+) \|)");
  std::map<std::string, Row> rows;
  for (std::sregex_iterator match(text.begin(), text.end(), row), end; match != end; ++match) {
    rows[(*match)[1]] = {(*match)[2], (*match)[3]};
  }
  return rows;
}

std::map<std::string, Row> ChannelsOfCode() {
  const std::string text = ReadAll(kSource / "services/common/bus/channels.h");
  const std::regex channel(R"(constexpr (State|Log)?Channel<fsmsg::(\w+)> \w+\{\"(\w+)\"\})");
  std::map<std::string, Row> channels;
  for (std::sregex_iterator match(text.begin(), text.end(), channel), end; match != end; ++match) {
    const std::string prefix = (*match)[1];
    channels[(*match)[3]] = {(*match)[2], prefix == "State" ? "state" : prefix == "Log" ? "log" : "stream"};
  }
  return channels;
}

std::vector<fs::path> TypeFiles() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kSource / "lcmtypes")) {
    if (entry.path().extension() == ".lcm") {
      files.push_back(entry.path());
    }
  }
  return files;
}

TEST(ChannelList, ReadmeListsExactlyTheChannelsOfTheCode) {
  auto rows = RowsOfReadme();
  ASSERT_GT(rows.size(), 20u);
  std::erase_if(rows, [](const auto& row) { return row.second.kind == "protocol"; });
  EXPECT_EQ(rows, ChannelsOfCode());
}

TEST(ChannelList, TheListAsDataIsThatOfTheCode) {
  std::map<std::string, Row> listed;
  for (const forgescan::ChannelInfo& channel : forgescan::AllChannels()) {
    const char* kind = channel.kind == forgescan::ChannelKind::kStream  ? "stream"
                       : channel.kind == forgescan::ChannelKind::kState ? "state"
                                                                        : "log";
    listed[channel.name] = {channel.type, kind};
    EXPECT_NE(channel.fingerprint, 0) << channel.name;
  }
  EXPECT_EQ(listed, ChannelsOfCode());
}

TEST(ChannelList, TheEmbeddedDefinitionsAreTheFiles) {
  std::map<std::string, std::string> files, embedded;
  for (const auto& file : TypeFiles()) {
    files[file.stem()] = ReadAll(file);
  }
  for (const forgescan::MessageDefinition& definition : forgescan::MessageDefinitions()) {
    embedded[std::string(definition.name)] = definition.text;
  }
  EXPECT_EQ(embedded, files);
  EXPECT_NE(forgescan::AllMessageDefinitions().find("struct frame_t {"), std::string::npos);
}

TEST(ChannelList, ProtocolChannelsAreListed) {
  const std::string code = ReadAll(kSource / "services/common/bus/protocol_channels.h");
  int listed = 0;
  for (const auto& [channel, row] : RowsOfReadme()) {
    if (row.kind == "protocol") {
      EXPECT_NE(code.find("\"" + channel + "\""), std::string::npos) << channel;
      ++listed;
    }
  }
  EXPECT_EQ(listed, 3);
}

TEST(ChannelList, EveryTypeIsOnAChannelOrNamedAsAPart) {
  std::set<std::string> used;
  for (const auto& [channel, row] : RowsOfReadme()) {
    used.insert(row.type);
  }
  const std::string readme = ReadAll(kSource / "lcmtypes/README.md");
  for (const auto& file : TypeFiles()) {
    const std::string type = file.stem();
    EXPECT_TRUE(used.erase(type) == 1 || readme.find("`" + type + "`") != std::string::npos) << type;
  }
  EXPECT_TRUE(used.empty()) << *used.begin() << " has no .lcm file";
}

TEST(ChannelList, EveryFieldSaysWhatItIs) {
  const std::regex field(R"(^ {4}(u?int\d+_t|double|float|string|byte|[a-z_]+_t) \w+(\[\w+\])?;(.*)$)");
  int fields = 0;
  for (const auto& file : TypeFiles()) {
    std::istringstream lines(ReadAll(file));
    for (std::string line; std::getline(lines, line);) {
      std::smatch match;
      if (std::regex_match(line, match, field)) {
        ++fields;
        EXPECT_THAT(match[3].str(), ::testing::ContainsRegex("// .")) << file << ": " << line;
      }
    }
  }
  EXPECT_GT(fields, 150);
}

TEST(ChannelList, StreamTypesBeginWithTheStreamHeader) {
  for (const auto& [channel, row] : RowsOfReadme()) {
    if (row.kind == "stream") {
      const std::string text = ReadAll(kSource / "lcmtypes" / (row.type + ".lcm"));
      const std::regex header(
          R"(\{\s+int64_t utime;.*\n\s+int64_t session;.*\n\s+int64_t sequence;.*\n\s+int32_t crc32;)");
      EXPECT_TRUE(std::regex_search(text, header)) << row.type;
    }
  }
}

}  // namespace
