#include "services/reconstruction/cloud_writer.h"

#include <emmintrin.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "services/common/huge_pages.h"

namespace forgescan {
namespace {

constexpr std::size_t kLine = 64;  // bytes the processor moves at a time

// Whole lines go past the cache.
template <typename T>
void Stream(std::span<const T> values, T* target) {
  if (values.empty()) {
    return;
  }
  const auto* from = reinterpret_cast<const char*>(values.data());
  auto* to = reinterpret_cast<char*>(target);
  std::size_t left = values.size_bytes();
  const std::size_t head = std::min(left, (kLine - reinterpret_cast<std::uintptr_t>(to) % kLine) % kLine);
  std::memcpy(to, from, head);
  from += head, to += head, left -= head;
  for (; left >= kLine; from += kLine, to += kLine, left -= kLine) {
    for (std::size_t i = 0; i < kLine; i += sizeof(__m128i)) {
      const __m128i part = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from + i));
      _mm_stream_si128(reinterpret_cast<__m128i*>(to + i), part);
    }
  }
  std::memcpy(to, from, left);
}

void Resize(std::size_t size, PointCloud& cloud) {
  ReserveHuge(size, cloud.points);
  ReserveHuge(size, cloud.normals);
  ReserveHuge(size, cloud.sigma_mm);
  cloud.points.resize(size);
  cloud.normals.resize(size);
  cloud.sigma_mm.resize(size);
}

}  // namespace

CloudWriter::CloudWriter(PointCloud memory, std::size_t used) : cloud_(std::move(memory)), size_(used) {
  cloud_.view.clear();
  Resize(std::max(cloud_.points.size(), used), cloud_);
}

void CloudWriter::Fit(std::size_t size) {
  if (size > cloud_.points.size()) {
    Resize(size <= cloud_.points.capacity() ? size : std::max(size, 2 * size_), cloud_);
  }
}

std::size_t CloudWriter::Grow(std::size_t count) {
  Fit(size_ + count);
  return std::exchange(size_, size_ + count);
}

PointTargets CloudWriter::Room(std::size_t count) {
  Fit(size_ + count);
  return {cloud_.points.data()->data() + 3 * size_, cloud_.normals.data()->data() + 3 * size_,
          cloud_.sigma_mm.data() + size_};
}

void CloudWriter::Append(const PointSpans& row) {
  const std::size_t begin = Grow(row.points.size());
  Stream(row.points, cloud_.points.data() + begin);
  Stream(row.normals, cloud_.normals.data() + begin);
  Stream(row.sigma_mm, cloud_.sigma_mm.data() + begin);
}

void CloudWriter::AppendThinned(const PointSpans& row, std::size_t first, std::size_t step) {
  const std::size_t count = row.points.size() > first ? (row.points.size() - first - 1) / step + 1 : 0;
  const std::size_t begin = Grow(count);
  for (std::size_t i = 0; i < count; ++i) {
    cloud_.points[begin + i] = row.points[first + i * step];
    cloud_.normals[begin + i] = row.normals[first + i * step];
    cloud_.sigma_mm[begin + i] = row.sigma_mm[first + i * step];
  }
}

PointCloud CloudWriter::Finish() && {
  _mm_sfence();
  Resize(size_, cloud_);
  return std::move(cloud_);
}

}  // namespace forgescan
