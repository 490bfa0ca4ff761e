#include "services/reconstruction/cloud_writer.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace forgescan {
namespace {

// Points first, first + 1, ...
struct Row {
  Row(int first, int count) {
    for (int i = 0; i < count; ++i) {
      const auto value = static_cast<float>(first + i);
      points.emplace_back(value, value + 0.25F, value + 0.5F);
      normals.emplace_back(-value, 1, 2);
      sigma_mm.push_back(value / 8);
    }
  }
  PointSpans spans() const { return {points, normals, sigma_mm}; }

  std::vector<Eigen::Vector3f> points, normals;
  std::vector<float> sigma_mm;
};

void ExpectAscending(const PointCloud& cloud, std::size_t count, int step) {
  ASSERT_EQ(cloud.points.size(), count);
  ASSERT_EQ(cloud.normals.size(), count);
  ASSERT_EQ(cloud.sigma_mm.size(), count);
  EXPECT_TRUE(cloud.view.empty());
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = static_cast<float>(static_cast<int>(i) * step);
    ASSERT_EQ(cloud.points[i], Eigen::Vector3f(value, value + 0.25F, value + 0.5F)) << i;
    ASSERT_EQ(cloud.normals[i], Eigen::Vector3f(-value, 1, 2)) << i;
    ASSERT_EQ(cloud.sigma_mm[i], value / 8) << i;
  }
}

// Rows of 0, 1, 2, ... points begin and end anywhere within a line of the cache.
PointCloud Write(CloudWriter writer, int first, int rows) {
  for (int count = 0; count < rows; ++count) {
    writer.Append(Row(first, count).spans());
    first += count;
  }
  return std::move(writer).Finish();
}

TEST(CloudWriter, KeepsTheOrderInFreshAndInUsedMemory) {
  const PointCloud cloud = Write(CloudWriter({}), 0, 60);
  ExpectAscending(cloud, 59 * 60 / 2, 1);
  PointCloud used = cloud;
  used.view.resize(used.size());
  ExpectAscending(Write(CloudWriter(std::move(used)), 0, 20), 19 * 20 / 2, 1);
  PointCloud small = Write(CloudWriter({}), 0, 5);
  ExpectAscending(Write(CloudWriter(std::move(small)), 0, 80), 79 * 80 / 2, 1);
}

TEST(CloudWriter, GoesOnBehindWhatStays) {
  PointCloud begun = Write(CloudWriter({}), 0, 10);
  const std::size_t size = begun.size();
  ExpectAscending(Write(CloudWriter(std::move(begun), size), static_cast<int>(size), 30), size + 29 * 30 / 2,
                  1);
}

TEST(CloudWriter, ThinsARow) {
  CloudWriter writer({});
  writer.AppendThinned(Row(0, 17).spans(), 0, 8);
  writer.AppendThinned(Row(17, 9).spans(), 7, 8);
  writer.AppendThinned(Row(26, 3).spans(), 6, 8);
  ExpectAscending(std::move(writer).Finish(), 4, 8);
}

}  // namespace
}  // namespace forgescan
