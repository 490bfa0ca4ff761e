#include "services/common/geometry/cloud_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

namespace forgescan {
namespace {

using ::testing::HasSubstr;

class CloudIoTest : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() / fmt::format("cloud_io_test.{}", getpid());
    std::filesystem::create_directories(directory_);
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path directory_;
};

template <typename T>
std::string Bytes(T value, bool big_endian) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

PointCloud TwoPoints() {
  PointCloud cloud;
  cloud.points = {{1, 2, 3}, {-4, 5.5F, 6}};
  cloud.normals = {{0, 0, -1}, {0, 1, 0}};
  cloud.sigma_mm = {0.25F, 0.5F};
  cloud.view = {3, 65535};
  return cloud;
}

constexpr char kAsciiMesh[] =
    "ply\r\nformat ascii 1.0\ncomment made by hand\nelement camera 1\nproperty list uchar int ids\n"
    "element vertex 4\nproperty double x\nproperty uchar red\nproperty float y\nproperty float z\n"
    "element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n"
    "2 7 8\n0 255 0 0\n1 0 0 0\n1 0 1 0\n0 0 1 +2.5e0\n9 4 0 1 2 3\n9 3 0 1 2\n";

TEST_F(CloudIoTest, Starts) {
  const auto path = directory_ / "cloud.ply";
  ASSERT_TRUE(WritePly(path, TwoPoints()).ok());
  const auto cloud = ReadPointCloud(path);
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->points, TwoPoints().points);
  EXPECT_EQ(cloud->normals, TwoPoints().normals);
  EXPECT_EQ(cloud->sigma_mm, TwoPoints().sigma_mm);
  EXPECT_EQ(cloud->view, TwoPoints().view);
}

TEST_F(CloudIoTest, WritesNothingWhenItCannot) {
  PointCloud broken = TwoPoints();
  broken.normals.pop_back();
  EXPECT_EQ(WritePly(directory_ / "a.ply", broken).error().code, ErrorCode::kInvalidArgument);
  std::filesystem::create_directories(directory_ / "taken.ply" / "full");
  EXPECT_EQ(WritePly(directory_ / "taken.ply", TwoPoints()).error().code, ErrorCode::kIo);
  EXPECT_EQ(WritePly(directory_ / "nowhere" / "a.ply", TwoPoints()).error().code, ErrorCode::kIo);
  const auto entries = std::distance(std::filesystem::directory_iterator(directory_), {});
  EXPECT_EQ(entries, 1);  // the directory "taken.ply" only
}

TEST(ParsePly, TakesAsciiWithOtherElementsAndProperties) {
  const auto mesh = ParseTriangleMesh(kAsciiMesh, "mesh");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->vertices.size(), 4U);
  EXPECT_EQ(mesh->vertices[3], Eigen::Vector3f(0, 1, 2.5F));
  ASSERT_EQ(mesh->triangles.size(), 3U);  // a quadrangle is two
  EXPECT_EQ(mesh->triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  const auto cloud = ParsePointCloud(kAsciiMesh, "mesh");
  ASSERT_TRUE(cloud.ok());
  EXPECT_EQ(cloud->size(), 4U);
}

TEST(ParsePly, TakesBothByteOrders) {
  for (const bool big : {false, true}) {
    const std::string header = fmt::format(
        "ply\nformat binary_{}_endian 1.0\nelement vertex 1\nproperty short x\nproperty double y\n"
        "property float z\nend_header\n",
        big ? "big" : "little");
    const auto cloud = ParsePointCloud(
        header + Bytes<std::int16_t>(-300, big) + Bytes(0.5, big) + Bytes(7.25F, big), "binary");
    ASSERT_TRUE(cloud.ok()) << cloud.error().message;
    EXPECT_EQ(cloud->points[0], Eigen::Vector3f(-300, 0.5F, 7.25F));
  }
}

TEST(ParsePly, RefusesEveryTruncation) {
  const std::string whole = kAsciiMesh;
  for (std::size_t length = 0; length + 2 < whole.size(); ++length) {
    const auto mesh = ParseTriangleMesh(whole.substr(0, length), "cut");
    ASSERT_FALSE(mesh.ok()) << length;
    EXPECT_EQ(mesh.error().code, ErrorCode::kFormat);
    EXPECT_THAT(mesh.error().message, HasSubstr("cut"));
  }
}

TEST(ParsePly, RefusesAHugeCountWithoutData) {
  const auto cloud = ParsePointCloud(
      "ply\nformat binary_little_endian 1.0\nelement vertex 18000000000000000000\nproperty float x\n"
      "property float y\nproperty float z\nend_header\nabc",
      "huge");
  ASSERT_FALSE(cloud.ok());
  EXPECT_THAT(cloud.error().message, HasSubstr("cut off"));
}

TEST(ParsePly, RefusesWrongFaces) {
  std::string mesh = kAsciiMesh;
  mesh.replace(mesh.find("9 3 0 1 2"), 9, "9 3 0 1 4");
  EXPECT_THAT(ParseTriangleMesh(mesh, "mesh").error().message, HasSubstr("vertex 4, allowed 0..3"));
  std::string not_finite = kAsciiMesh;
  not_finite.replace(not_finite.find("+2.5e0"), 6, "nan");
  EXPECT_THAT(ParseTriangleMesh(not_finite, "mesh").error().message, HasSubstr("not finite"));
}

TEST(ParsePcd, TakesAsciiAndBinaryAndDropsMissingPoints) {
  const std::string header =
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb normal_x normal_y normal_z\n"
      "SIZE 4 4 4 4 4 4 4\nTYPE F F F U F F F\nCOUNT 1 1 1 2 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ";
  const auto ascii = ParsePointCloud(header + "ascii\nnan nan nan 1 2 0 0 1\n1 2 3 4 5 0 0 -1\n", "ascii");
  ASSERT_TRUE(ascii.ok()) << ascii.error().message;
  ASSERT_EQ(ascii->size(), 1U);
  EXPECT_EQ(ascii->normals[0], Eigen::Vector3f(0, 0, -1));
  std::string body;
  for (int i = 0; i < 16; ++i) {
    body += Bytes(static_cast<float>(i), false);
  }
  const auto binary = ParsePointCloud(header + "binary\n" + body, "binary");
  ASSERT_TRUE(binary.ok()) << binary.error().message;
  EXPECT_EQ(binary->points[1], Eigen::Vector3f(8, 9, 10));
  EXPECT_FALSE(ParsePointCloud(header + "binary\n" + body.substr(0, 40), "cut").ok());
  EXPECT_THAT(ParsePointCloud(header + "binary_compressed\n" + body, "packed").error().message,
              HasSubstr("binary_compressed"));
}

std::string AsciiCloud(const std::string& properties, const std::string& rows) {
  return "ply\nformat ascii 1.0\nelement vertex 2\n" + properties + "end_header\n" + rows;
}
constexpr char kXyz[] = "property float x\nproperty float y\nproperty float z\n";

// What must not be read as points, and the words that say why.
TEST(ParsePly, TakesAFileWholeOrNotAtAll) {
  ASSERT_TRUE(ParsePointCloud(AsciiCloud(kXyz, "1 2 3\n4 5 6\n"), "cloud").ok());
  ASSERT_TRUE(ParsePointCloud(AsciiCloud(kXyz, "1 2 3\r\n4 5 6\r\n\n"), "cloud").ok());
  EXPECT_TRUE(ParsePointCloud(AsciiCloud(kXyz, "1 2 3\n4 -100000 6\n"), "cloud").ok());
  const std::string twice = std::string(kXyz) + "property float x\n";
  const std::string alias = std::string(kXyz) + "property float nx\nproperty float normal_x\n";
  const std::string view = std::string(kXyz) + "property ushort view\n";
  const std::pair<std::string, const char*> kWrong[] = {
      {AsciiCloud(kXyz, "1 2 3 9\n4 5 6\n"), "vertex 1 of 2"},
      {AsciiCloud(kXyz, "1 2\n3 4 5 6\n"), "vertex 1 of 2"},
      {AsciiCloud(kXyz, "1 2 3 4 5 6\n"), "vertex 1 of 2"},
      {AsciiCloud(kXyz, "1 2 3\n\n4 5 6\n"), "vertex 2 of 2"},
      {AsciiCloud(kXyz, "1 2 3\n4 5 6\n7 8 9\n"), "6 bytes follow"},
      {AsciiCloud(kXyz, "1 2 3\n4 5 1e300\n"), "too large"},
      {AsciiCloud(kXyz, "1 2 3\n4 5 1e400\n"), "vertex 2 of 2"},
      {AsciiCloud(kXyz, "1 2 3\n4 -100000.1 6\n"), "-100000.1 of point 2 is beyond 100000 mm"},
      {AsciiCloud(twice, "1 2 3 1\n4 5 6 4\n"), "property x twice"},
      {AsciiCloud(alias, "1 2 3 0 0\n4 5 6 0 0\n"), "normal_x twice"},
      {AsciiCloud(view, "1 2 3 0\n4 5 6 1.5\n"), "1.5 of point 2"},
  };
  for (const auto& [bytes, words] : kWrong) {
    const auto cloud = ParsePointCloud(bytes, "cloud");
    ASSERT_FALSE(cloud.ok()) << bytes;
    EXPECT_THAT(cloud.error().message, HasSubstr(words));
    EXPECT_THAT(cloud.error().message, HasSubstr("cloud: "));
  }
}

TEST(ParsePly, RefusesFacesThatAreNoPolygons) {
  for (const char* row : {"9 3 0 1 1.5", "9 2.5 0 1 2", "9 2 0 1", "9 3 0 1 2 3"}) {
    std::string mesh = kAsciiMesh;
    mesh.replace(mesh.find("9 3 0 1 2"), 9, row);
    EXPECT_FALSE(ParseTriangleMesh(mesh, "mesh").ok()) << row;
    // Of a cloud the faces are skipped, but not unread; what they name does not matter to it.
    const bool is_table = std::string(row) != "9 2.5 0 1 2" && std::string(row) != "9 3 0 1 2 3";
    EXPECT_EQ(ParsePointCloud(mesh, "mesh").ok(), is_table) << row;
  }
  EXPECT_FALSE(ParseTriangleMesh(std::string(kAsciiMesh) + "9 3 0 1 2\n", "mesh").ok());
}

TEST(ParsePly, CountsPointsThatAreNotFinite) {
  const auto cloud = ParsePointCloud(AsciiCloud(kXyz, "1 2 3\n4 nan 6\n"), "cloud");
  ASSERT_TRUE(cloud.ok()) << cloud.error().message;
  EXPECT_EQ(cloud->size(), 1U);
  EXPECT_EQ(cloud->not_finite, 1U);
}

TEST(ParsePcd, CountsMustAgree) {
  const auto file = [](const std::string& counts, const std::string& rows) {
    return "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n" + counts + "DATA ascii\n" + rows;
  };
  const std::string two = "1 2 3\n4 5 6\n";
  EXPECT_TRUE(ParsePointCloud(file("WIDTH 1\nHEIGHT 2\nPOINTS 2\n", two), "c").ok());
  EXPECT_TRUE(ParsePointCloud(file("POINTS 2\n", two), "c").ok());
  EXPECT_THAT(ParsePointCloud(file("WIDTH 3\nHEIGHT 1\nPOINTS 2\n", two), "c").error().message,
              HasSubstr("WIDTH times HEIGHT is 3"));
  EXPECT_THAT(ParsePointCloud(file("WIDTH 1\nHEIGHT 1\nPOINTS 1\n", two), "c").error().message,
              HasSubstr("6 bytes follow"));
  EXPECT_FALSE(ParsePointCloud(file("POINTS 3\n", two), "c").ok());
  EXPECT_FALSE(ParsePointCloud(file("POINTS 2\n", "1 2 3 4\n5 6\n"), "c").ok());
}

TEST(ReadPointCloud, NamesWhatIsNotThere) {
  const auto cloud = ReadPointCloud("/nonexistent/cloud.ply");
  EXPECT_EQ(cloud.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(cloud.error().message, HasSubstr("/nonexistent/cloud.ply"));
  EXPECT_EQ(ParsePointCloud("solid cube", "text").error().code, ErrorCode::kFormat);
}

}  // namespace
}  // namespace forgescan
