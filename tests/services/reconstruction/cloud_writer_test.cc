#include "services/reconstruction/cloud_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// Written in place; memory that fits a cloud has no room for a whole row more.
TEST(CloudWriter, GivesRoomForMoreThanComes) {
  PointCloud cloud = Write(CloudWriter({}), 0, 20);
  const auto size = static_cast<int>(cloud.size());
  for (int run = 0; run < 2; ++run) {
    CloudWriter writer(std::move(cloud));
    for (int first = 0; first < size; first += 19) {
      const Row row(first, std::min(19, size - first));
      const PointTargets to = writer.Room(500);
      std::copy_n(row.points[0].data(), 3 * row.points.size(), to.points_mm);
      std::copy_n(row.normals[0].data(), 3 * row.points.size(), to.normals);
      std::copy_n(row.sigma_mm.data(), row.points.size(), to.sigma_mm);
      writer.Added(row.points.size());
    }
    cloud = std::move(writer).Finish();
    ExpectAscending(cloud, static_cast<std::size_t>(size), 1);
  }
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
