#include "services/common/bus/cloud_stream.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>

#include "services/common/bus/bus.h"

namespace forgescan {
namespace {

PointCloud MakeCloud(std::size_t points) {
  PointCloud cloud;
  for (std::size_t i = 0; i < points; ++i) {
    const auto x = static_cast<float>(i);
    cloud.points.emplace_back(x, -x, 0.5F * x);
    cloud.normals.emplace_back(0.F, 0.F, 1.F);
    cloud.sigma_mm.push_back(0.01F * x);
    cloud.view.push_back(static_cast<std::uint16_t>(i % 10));
  }
  return cloud;
}

TEST(CloudStream, ComesBackFromSlicesInAnyOrder) {
  const PointCloud cloud = MakeCloud(300'000);
  auto slices = SliceCloud(cloud, 1, 4, kAllViews);
  ASSERT_TRUE(slices.ok());
  ASSERT_EQ(slices->size(), 3u);
  EXPECT_LT(slices->front().data.size(), kMaxMessageBytes);
  std::reverse(slices->begin(), slices->end());
  CloudAssembler assembler;
  std::optional<PointCloud> back;
  for (const auto& slice : *slices) {
    EXPECT_FALSE(back.has_value());
    back = *assembler.Add(slice);
  }
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->points, cloud.points);
  EXPECT_EQ(back->normals, cloud.normals);
  EXPECT_EQ(back->sigma_mm, cloud.sigma_mm);
  EXPECT_EQ(back->view, cloud.view);
}

TEST(CloudStream, AnEmptyCloudIsACloud) {
  CloudAssembler assembler;
  const auto back = assembler.Add(SliceCloud({}, 1, 1, 0)->front());
  ASSERT_TRUE(back.ok() && back->has_value());
  EXPECT_TRUE((*back)->empty());
}

TEST(CloudStream, TwoCloudsMayInterleave) {
  const auto a = *SliceCloud(MakeCloud(200'000), 1, 1, 0), b = *SliceCloud(MakeCloud(150'000), 1, 2, 0);
  CloudAssembler assembler;
  EXPECT_FALSE((*assembler.Add(a[0])).has_value());
  EXPECT_FALSE((*assembler.Add(b[0])).has_value());
  EXPECT_EQ((*assembler.Add(a[1]))->size(), 200'000u);
  EXPECT_EQ((*assembler.Add(b[1]))->size(), 150'000u);
}

TEST(CloudStream, TwoAttemptsAtAViewAreTwoClouds) {
  const auto first = *SliceCloud(MakeCloud(200'000), 1, 1, 0),
             second = *SliceCloud(MakeCloud(200'000), 2, 1, 0);
  CloudAssembler assembler;
  EXPECT_FALSE((*assembler.Add(first[0])).has_value());
  EXPECT_FALSE((*assembler.Add(second[1])).has_value()) << "half of each is no cloud";
  EXPECT_TRUE((*assembler.Add(second[0])).has_value());
  EXPECT_TRUE((*assembler.Add(first[1])).has_value());
}

TEST(CloudStream, AnotherSizeAtTheSameViewIsNoContradictionOfTheLastAttempt) {
  const auto first = *SliceCloud(MakeCloud(200'000), 1, 1, 0),
             second = *SliceCloud(MakeCloud(150'000), 2, 1, 0);
  CloudAssembler assembler;
  EXPECT_FALSE((*assembler.Add(first[0])).has_value());
  EXPECT_TRUE(assembler.Add(second[0]).ok());
  EXPECT_EQ((*assembler.Add(second[1]))->size(), 150'000u);
}

TEST(CloudStream, TheOldestOpenCloudMakesRoom) {
  const auto slices = *SliceCloud(MakeCloud(150'000), 0, 1, 0);
  const auto of = [&slices](std::int64_t utime, std::size_t k) {
    auto slice = slices[k];
    slice.utime = utime;
    return slice;
  };
  CloudAssembler assembler;
  const auto count = static_cast<std::int64_t>(CloudAssembler::kMaxOpen);
  for (std::int64_t utime = 0; utime <= count; ++utime) {
    EXPECT_FALSE((*assembler.Add(of(utime, 0))).has_value());
  }
  for (std::int64_t utime = 1; utime <= count; ++utime) {
    EXPECT_TRUE((*assembler.Add(of(utime, 1))).has_value()) << utime;
  }
  EXPECT_FALSE((*assembler.Add(of(0, 1))).has_value()) << "its first half is gone";
}

TEST(CloudStream, ForgetsAllCloudsOfAPart) {
  const auto a = *SliceCloud(MakeCloud(200'000), 1, 1, 0), b = *SliceCloud(MakeCloud(200'000), 1, 2, 0);
  CloudAssembler assembler;
  EXPECT_FALSE((*assembler.Add(a[0])).has_value());
  EXPECT_FALSE((*assembler.Add(b[0])).has_value());
  assembler.Forget(1);
  EXPECT_FALSE((*assembler.Add(a[1])).has_value());
  EXPECT_TRUE((*assembler.Add(b[1])).has_value());
}

TEST(CloudStream, ContradictionsAreErrorsAndTheNextCloudWorks) {
  const auto good = SliceCloud(MakeCloud(10), 1, 1, 0)->front();
  CloudAssembler assembler;
  for (const auto& spoil : std::vector<std::function<void(fsmsg::cloud_slice_t&)>>{
           [](auto& s) { s.points = 11; }, [](auto& s) { s.first_point = -1; }, [](auto& s) { s.slice = 1; },
           [](auto& s) { s.points_total = 2'000'000'000; }, [](auto& s) { s.slice_count = 1'000'000; },
           [](auto& s) { s.data.pop_back(); }}) {
    auto bad = good;
    spoil(bad);
    EXPECT_FALSE(assembler.Add(bad).ok());
  }
  EXPECT_TRUE(assembler.Add(good)->has_value());
}

// What is not there takes no memory: 100 million points would be 3 GB.
TEST(CloudStream, ASliceThatPromisesManyPointsAndBringsOne) {
  auto slice = SliceCloud(MakeCloud(1), 1, 1, 0)->front();
  slice.points_total = 100'000'000;
  slice.slice_count = 2;
  const auto used_kb = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const auto before_kb = used_kb();
  CloudAssembler assembler;
  EXPECT_FALSE((*assembler.Add(slice)).has_value());
  EXPECT_LT(used_kb() - before_kb, 100'000);
  slice.slice = 1;
  EXPECT_FALSE(assembler.Add(slice).ok()) << "together they are not the cloud";
}

TEST(CloudStream, SlicesOfTheSamePointsAreNoCloud) {
  auto slices = *SliceCloud(MakeCloud(200'000), 1, 1, 0);
  slices[1] = slices[0];
  slices[1].slice = 1;
  CloudAssembler assembler;
  EXPECT_FALSE((*assembler.Add(slices[0])).has_value());
  EXPECT_FALSE(assembler.Add(slices[1]).ok());
}

TEST(CloudStream, AMissingMemberIsRefused) {
  PointCloud cloud = MakeCloud(3);
  cloud.normals.clear();
  EXPECT_FALSE(SliceCloud(cloud, 1, 1, 0).ok());
}

}  // namespace
}  // namespace forgescan
