#include "services/common/bus/cloud_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace forgescan {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the layout of a point is written for little-endian hosts");

constexpr std::size_t kPointBytes = 30;
constexpr std::size_t kSlicePoints = 4'000'000 / kPointBytes;
constexpr std::size_t kMaxPoints = 100'000'000;

void Pack(const PointCloud& cloud, std::size_t i, std::uint8_t* to) {
  const Eigen::Vector3f &p = cloud.points[i], &n = cloud.normals[i];
  const std::array<float, 7> values{p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), cloud.sigma_mm[i]};
  std::memcpy(to, values.data(), sizeof values);
  std::memcpy(to + sizeof values, &cloud.view[i], sizeof cloud.view[i]);
}

void Unpack(const std::uint8_t* from, std::size_t i, PointCloud& cloud) {
  std::array<float, 7> values{};
  std::memcpy(values.data(), from, sizeof values);
  cloud.points[i] = {values[0], values[1], values[2]};
  cloud.normals[i] = {values[3], values[4], values[5]};
  cloud.sigma_mm[i] = values[6];
  std::memcpy(&cloud.view[i], from + sizeof values, sizeof cloud.view[i]);
}

void Resize(PointCloud& cloud, std::size_t points) {
  cloud.points.resize(points);
  cloud.normals.resize(points);
  cloud.sigma_mm.resize(points);
  cloud.view.resize(points);
}

bool IsConsistent(const fsmsg::cloud_slice_t& slice) {
  const auto total = static_cast<std::size_t>(slice.points_total),
             first = static_cast<std::size_t>(slice.first_point),
             count = static_cast<std::size_t>(slice.points);
  return slice.points_total >= 0 && slice.first_point >= 0 && slice.points >= 0 && total <= kMaxPoints &&
         slice.slice >= 0 && slice.slice < slice.slice_count && first + count <= total &&
         static_cast<std::size_t>(slice.slice_count) <= total / kSlicePoints + 1 &&
         slice.data.size() == count * kPointBytes;
}

Error Contradicts(const fsmsg::cloud_slice_t& slice) {
  return Fail(ErrorCode::kFormat, "part {} view {}: slice {} of {} contradicts its cloud", slice.part,
              slice.view, slice.slice, slice.slice_count);
}

// All slices of a cloud, each consistent with it.
Result<PointCloud> Join(const std::vector<std::optional<fsmsg::cloud_slice_t>>& slices) {
  std::int32_t points = 0;
  for (const auto& slice : slices) {
    if (slice->first_point != points) {
      return Contradicts(*slice);
    }
    points += slice->points;
  }
  if (points != slices.back()->points_total) {
    return Contradicts(*slices.back());
  }
  PointCloud cloud;
  Resize(cloud, static_cast<std::size_t>(points));
  for (const auto& slice : slices) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(slice->points); ++i) {
      Unpack(slice->data.data() + i * kPointBytes, static_cast<std::size_t>(slice->first_point) + i, cloud);
    }
  }
  return cloud;
}

}  // namespace

Result<std::vector<fsmsg::cloud_slice_t>> SliceCloud(const PointCloud& cloud, std::int64_t utime, int part,
                                                     int view) {
  const std::size_t total = cloud.size();
  if (cloud.normals.size() != total || cloud.sigma_mm.size() != total || cloud.view.size() != total) {
    return Fail(ErrorCode::kInvalidArgument,
                "a cloud of {} points has {} normals, {} sigmas and {} view numbers", total,
                cloud.normals.size(), cloud.sigma_mm.size(), cloud.view.size());
  }
  const std::size_t count = std::max<std::size_t>(1, (total + kSlicePoints - 1) / kSlicePoints);
  std::vector<fsmsg::cloud_slice_t> slices(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = k * kSlicePoints, points = std::min(kSlicePoints, total - first);
    fsmsg::cloud_slice_t& slice = slices[k];
    slice.utime = utime;
    slice.part = part;
    slice.view = view;
    slice.slice = static_cast<std::int32_t>(k);
    slice.slice_count = static_cast<std::int32_t>(count);
    slice.first_point = static_cast<std::int32_t>(first);
    slice.points = static_cast<std::int32_t>(points);
    slice.points_total = static_cast<std::int32_t>(total);
    slice.data.resize(points * kPointBytes);
    slice.size = static_cast<std::int32_t>(slice.data.size());
    for (std::size_t i = 0; i < points; ++i) {
      Pack(cloud, first + i, slice.data.data() + i * kPointBytes);
    }
  }
  return slices;
}

CloudAssembler::Open& CloudAssembler::OpenFor(const fsmsg::cloud_slice_t& slice) {
  const Key key{slice.part, slice.view, slice.utime};
  if (open_.Find(key) == nullptr) {
    Open open;
    open.points_total = static_cast<std::size_t>(slice.points_total);
    open.slices.resize(static_cast<std::size_t>(slice.slice_count));
    open.missing = open.slices.size();
    open_.Insert(key, std::move(open));
  }
  return *open_.Find(key);
}

Result<std::optional<PointCloud>> CloudAssembler::Add(const fsmsg::cloud_slice_t& slice) {
  const Key key{slice.part, slice.view, slice.utime};
  Open* open = IsConsistent(slice) ? &OpenFor(slice) : nullptr;
  if (open == nullptr || open->slices.size() != static_cast<std::size_t>(slice.slice_count) ||
      open->points_total != static_cast<std::size_t>(slice.points_total)) {
    open_.Take(key);
    return Contradicts(slice);
  }
  auto& place = open->slices[static_cast<std::size_t>(slice.slice)];
  if (!place) {
    place = slice;
    --open->missing;
  }
  if (open->missing > 0) {
    return std::optional<PointCloud>();
  }
  ASSIGN_OR_RETURN(PointCloud cloud, Join(open_.Take(key)->slices));
  return std::optional<PointCloud>(std::move(cloud));
}

void CloudAssembler::Forget(int part) {
  open_.EraseIf([part](const Key& key) { return std::get<0>(key) == part; });
}

void CloudAssembler::Forget(int part, std::int64_t utime) {
  open_.EraseIf(
      [part, utime](const Key& key) { return std::get<0>(key) == part && std::get<2>(key) == utime; });
}

}  // namespace forgescan
