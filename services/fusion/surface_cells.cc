#include "services/fusion/surface_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace forgescan {
namespace {

constexpr std::int64_t kOffset = std::int64_t{1} << 31;  // keys of directions to the left are positive too

constexpr unsigned kDigitBits = 11;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;

struct Item {
  std::uint64_t key;
  std::uint32_t point;
};

// Counts the cells of the smallest rectangle that holds all keys, row by row: few digits to sort by.
class CellCounter {
 public:
  explicit CellCounter(const std::vector<Item>& items) {
    for (const Item& item : items) {
      const std::uint64_t x = item.key & kLow, y = item.key >> 32;
      low_x_ = std::min(low_x_, x);
      low_y_ = std::min(low_y_, y);
      high_x_ = std::max(high_x_, x);
      high_y_ = std::max(high_y_, y);
    }
  }
  std::uint64_t NumberOf(std::uint64_t key) const {
    return ((key >> 32) - low_y_) * (high_x_ - low_x_ + 1) + (key & kLow) - low_x_;
  }
  std::uint64_t Largest() const { return NumberOf(high_y_ << 32 | high_x_); }

 private:
  static constexpr std::uint64_t kLow = 0xffffffff;
  std::uint64_t low_x_ = kLow, low_y_ = kLow, high_x_ = 0, high_y_ = 0;
};

// Ascending keys, points of one key in their order: digit by digit, from the lowest.
void SortByKey(std::vector<Item>& items) {
  if (items.empty()) return;
  const CellCounter counter(items);
  std::vector<Item> sorted(items.size());
  for (unsigned shift = 0; shift < 64 && counter.Largest() >> shift != 0; shift += kDigitBits) {
    const auto digit = [&](const Item& item) { return counter.NumberOf(item.key) >> shift & (kDigits - 1); };
    std::array<std::size_t, kDigits + 1> begin{};
    for (const Item& item : items) ++begin[digit(item) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const Item& item : items) sorted[begin[digit(item)]++] = item;
    items.swap(sorted);
  }
}

SurfaceCell MeanOf(const PointCloud& cloud, const Item* begin, const Item* end) {
  SurfaceCell cell{begin->key, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0};
  const auto count = static_cast<double>(end - begin);
  for (const Item* item = begin; item != end; ++item) {
    const double sigma_mm = cloud.sigma_mm[item->point];
    cell.point += cloud.points[item->point].cast<double>();
    cell.normal += cloud.normals[item->point].cast<double>();
    cell.variance_mm2 += sigma_mm * sigma_mm;
  }
  cell.point /= count;
  cell.normal /= count;
  cell.variance_mm2 /= count * count;
  return cell;
}

double SpreadMm(const PointCloud& cloud, const Item* begin, const Item* end, const SurfaceCell& cell) {
  double squares = 0;
  for (const Item* item = begin; item != end; ++item) {
    const double off_mm = cell.normal.dot(cloud.points[item->point].cast<double>() - cell.point);
    squares += off_mm * off_mm;
  }
  return std::sqrt(squares / static_cast<double>(end - begin));
}

}  // namespace

double CellRadOf(double focal_px, int every_nth_point) { return 3 * std::sqrt(every_nth_point) / focal_px; }

std::optional<std::uint64_t> DirectionKey(const Eigen::Vector3d& p_in_camera, double cell_rad) {
  const double right = std::floor(p_in_camera.x() / p_in_camera.z() / cell_rad);
  const double down = std::floor(p_in_camera.y() / p_in_camera.z() / cell_rad);
  constexpr auto kFarthest = static_cast<double>(kOffset);
  if (!(p_in_camera.z() > 0 && std::abs(right) < kFarthest &&
        std::abs(down) < kFarthest)) {  // not so for NaN
    return std::nullopt;
  }
  const auto place = [](double cell) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(cell) + kOffset);
  };
  return place(down) << 32 | place(right);
}

std::vector<SurfaceCell> SurfaceCells(const PointCloud& cloud_in_camera, const SurfaceCellOptions& options) {
  std::vector<Item> items;
  items.reserve(cloud_in_camera.size());
  for (std::uint32_t i = 0; i < cloud_in_camera.size(); ++i) {
    const auto key = DirectionKey(cloud_in_camera.points[i].cast<double>(), options.cell_rad);
    if (key) items.push_back({*key, i});
  }
  SortByKey(items);
  std::vector<SurfaceCell> cells;
  const Item* const end = items.data() + items.size();
  for (const Item* begin = items.data(); begin != end;) {
    const Item* next = begin;
    while (next != end && next->key == begin->key) ++next;
    if (static_cast<std::size_t>(next - begin) >= options.min_points) {
      SurfaceCell cell = MeanOf(cloud_in_camera, begin, next);
      if (cell.normal.norm() >= options.min_coherence) {
        cell.normal.normalize();
        if (SpreadMm(cloud_in_camera, begin, next, cell) <= options.max_spread_mm) cells.push_back(cell);
      }
    }
    begin = next;
  }
  return cells;
}

}  // namespace forgescan
