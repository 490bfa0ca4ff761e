#include "services/common/input_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class InputFile : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  // The error names the file.
  void ExpectRefused(const fs::path& path, ErrorCode code, const char* why) const {
    const auto text = ReadInputFile(path);
    ASSERT_FALSE(text.ok()) << path;
    EXPECT_EQ(text.error().code, code);
    EXPECT_THAT(text.error().message, HasSubstr(path.string()));
    EXPECT_THAT(text.error().message, HasSubstr(why));
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("input_file_" + std::to_string(getpid()));
  const fs::path path_ = folder_ / "in";
};

TEST_F(InputFile, StartsAndReadsEveryByte) {
  const std::string bytes("a\r\n\0\xFF\x1A end", 10);
  std::ofstream(path_, std::ios::binary) << bytes;
  fs::create_symlink(path_, folder_ / "link");
  for (const fs::path& path : {path_, folder_ / "link"}) {
    const auto text = ReadInputFile(path);
    ASSERT_TRUE(text.ok()) << text.error().message;
    EXPECT_EQ(*text, bytes);
  }
}

TEST_F(InputFile, AnEmptyFileIsAnEmptyText) {
  std::ofstream{path_};
  const auto text = ReadInputFile(path_);
  ASSERT_TRUE(text.ok()) << text.error().message;
  EXPECT_EQ(*text, "");
}

TEST_F(InputFile, WhatIsNotThereIsNamed) {
  ExpectRefused(path_, ErrorCode::kNotFound, "No such file");
  std::ofstream{path_};
  ExpectRefused(path_ / "below_a_file", ErrorCode::kNotFound, "cannot be read");
}

TEST_F(InputFile, AFolderIsNoFile) { ExpectRefused(folder_, ErrorCode::kIo, "not a plain file"); }

// Nobody writes into it: opening it would wait for ever.
TEST_F(InputFile, APipeIsNotWaitedFor) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  ExpectRefused(path_, ErrorCode::kIo, "not a plain file");
}

TEST_F(InputFile, ADeviceIsNotReadForEver) {
  ExpectRefused("/dev/zero", ErrorCode::kIo, "not a plain file");
}

TEST_F(InputFile, AFileBeyondTheLimitIsRefusedBeforeItIsRead) {
  std::ofstream{path_};
  fs::resize_file(path_, (std::uintmax_t{4} << 30) + 1);  // a hole: takes no room
  ExpectRefused(path_, ErrorCode::kFormat, "4294967297 bytes");
}

}  // namespace
}  // namespace forgescan
