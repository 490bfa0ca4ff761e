// Every writer of a user's file: whole or not there; a device or a pipe stays what it is.
#include "services/common/output_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <iterator>

#include "services/common/geometry/cloud_io.h"
#include "services/common/model/bundle_file.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

struct Writer {
  const char* name;
  const char* begins;  // what it writes
  std::function<Status(const fs::path&)> write;
};

class OutputFile : public ::testing::TestWithParam<Writer> {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  long FileCount() const { return std::distance(fs::directory_iterator(folder_), fs::directory_iterator()); }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("output_file_" + std::to_string(getpid()));
  const fs::path path_ = folder_ / "out";
};

std::string Read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_P(OutputFile, StartsAndReplacesAFile) {
  std::ofstream(path_) << "old";
  ASSERT_TRUE(GetParam().write(path_).ok());
  EXPECT_EQ(Read(path_).find(GetParam().begins), 0u);
  EXPECT_EQ(FileCount(), 1);
}

TEST_P(OutputFile, NamesAFolderThatIsNotThere) {
  const Status status = GetParam().write(folder_ / "none" / "out");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_EQ(FileCount(), 0);
}

TEST_P(OutputFile, TheReaderOfAPipeGetsTheBytes) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  const int reader = open(path_.c_str(), O_RDONLY | O_NONBLOCK);  // so that no writer has to wait for one
  const Status status = GetParam().write(path_);
  std::string got(4096, '\0');  // less than a pipe holds
  const ssize_t count = read(reader, got.data(), got.size());
  close(reader);
  EXPECT_TRUE(status.ok());
  EXPECT_TRUE(fs::is_fifo(path_));
  ASSERT_GT(count, 0);
  EXPECT_EQ(got.find(GetParam().begins), 0u);
}

TEST_P(OutputFile, AFullDeviceIsAnErrorAndStays) {
  if (mknod(path_.c_str(), S_IFCHR | 0600, makedev(1, 7)) != 0 || !std::ofstream(path_)) {
    GTEST_SKIP() << "needs the right to make a device node";
  }
  const Status status = GetParam().write(path_);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kIo);
  EXPECT_TRUE(fs::is_character_file(path_));
}

INSTANTIATE_TEST_SUITE_P(
    Writers, OutputFile,
    ::testing::Values(
        Writer{"text", "text", [](const fs::path& path) { return WriteOutputFile(path, "text\n"); }},
        Writer{"ply", "ply\n", [](const fs::path& path) { return WritePly(path, PointCloud{}); }},
        Writer{"bundle", "FSBUNDLE", [](const fs::path& path) { return WriteBundle(ModelBundle{}, path); }}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace forgescan
