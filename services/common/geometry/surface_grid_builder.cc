#include "services/common/geometry/surface_grid_builder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <vector>

#include "services/common/parallel_blocks.h"

namespace forgescan {
namespace {

using Arrays = SurfaceGridArrays;
using Bricks = std::array<std::uint32_t, 3>;

constexpr std::size_t kMaxWords = std::size_t{16} << 20;  // 64 MB
constexpr std::size_t kMaxTriangles = std::size_t{1} << 27;
constexpr std::size_t kBricksOfBlock = 64;
constexpr float kDetail_mm = 16;       // voxels are stored this far from the surface: where scans start
constexpr float kRounding_mm = 0.01F;  // a hundred times single precision over a 2 m part
constexpr float kAnywhere = 1e18F;     // its square is finite

struct Layout {
  Eigen::Vector3f low;
  float voxel_mm;
  Bricks bricks;

  std::size_t count() const { return std::size_t{bricks[0]} * bricks[1] * bricks[2]; }
  float brick_mm() const { return voxel_mm * Arrays::kSide; }
  Eigen::Vector3f CornerOf(std::size_t brick) const {
    const std::size_t x = brick % bricks[0], y = brick / bricks[0] % bricks[1],
                      z = brick / bricks[0] / bricks[1];
    return low +
           brick_mm() * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  }
};

// The arrays of the whole grid, or of a block of bricks with indices from the block's own beginning.
struct Words {
  std::vector<std::uint32_t> tops, voxels, lists;
};

std::uint32_t Word(std::size_t value, std::size_t count) {
  return static_cast<std::uint32_t>(value << Arrays::kCountBits | count);
}

// A triangle can be nearest to a place of the voxel only if it is no farther from the centre than the nearest
// one and two half diagonals.
std::uint32_t VoxelWord(const TriangleIndex& surface, const Eigen::Vector3f& center, float half_mm,
                        std::vector<std::uint32_t>& lists, std::uint32_t& hint) {
  const auto nearest = surface.Find(center, kAnywhere, hint);
  hint = nearest->triangle;
  const float nearest_mm = nearest->distance_mm;
  if (nearest_mm > SurfaceGrid::kBand_mm + half_mm + kRounding_mm) return Word(hint, 0);
  std::vector<TriangleIndex::Distance> near =
      surface.FindWithin(center, nearest_mm + 2 * half_mm + kRounding_mm, Arrays::kMostListed + 1);
  if (near.size() > Arrays::kMostListed) return Word(hint, Arrays::kCrowded);
  if (near.size() == 1) return Word(near[0].triangle, 1);
  // In one order, so that neighbouring voxels can share a list.
  std::sort(near.begin(), near.end(), [](const auto& x, const auto& y) { return x.triangle < y.triangle; });
  const std::uint32_t word = Word(lists.size(), near.size());
  for (const auto& entry : near) lists.push_back(entry.triangle);
  return word;
}

void AddBrick(const TriangleIndex& surface, const Layout& layout, std::size_t brick, Words& words,
              std::uint32_t& hint) {
  const float half_diagonal = 0.5F * std::sqrt(3.0F);
  const Eigen::Vector3f corner = layout.CornerOf(brick);
  const Eigen::Vector3f center = corner + Eigen::Vector3f::Constant(0.5F * layout.brick_mm());
  const auto hit = surface.Find(center, kAnywhere, hint);
  hint = hit->triangle;
  if (hit->distance_mm > kDetail_mm + half_diagonal * layout.brick_mm() + kRounding_mm) {
    words.tops.push_back(hit->triangle);
    return;
  }
  words.tops.push_back(Arrays::kDetailed |
                       static_cast<std::uint32_t>(words.voxels.size() / Arrays::kVoxelsOfBrick));
  for (std::uint32_t i = 0; i < Arrays::kVoxelsOfBrick; ++i) {
    const Eigen::Vector3f at(static_cast<float>(i % Arrays::kSide),
                             static_cast<float>(i / Arrays::kSide % Arrays::kSide),
                             static_cast<float>(i / Arrays::kSide / Arrays::kSide));
    const Eigen::Vector3f place = corner + layout.voxel_mm * (at + Eigen::Vector3f::Constant(0.5F));
    words.voxels.push_back(VoxelWord(surface, place, half_diagonal * layout.voxel_mm, words.lists, hint));
  }
}

// Joins blocks to one grid, in which equal lists are stored once.
class Joiner {
 public:
  void Append(const Words& block) {
    const auto brick0 = static_cast<std::uint32_t>(all_.voxels.size() / Arrays::kVoxelsOfBrick);
    for (const std::uint32_t top : block.tops) {
      all_.tops.push_back((top & Arrays::kDetailed) != 0 ? top + brick0 : top);
    }
    for (const std::uint32_t word : block.voxels) {
      const std::uint32_t count = word & Arrays::kCountMask, value = word >> Arrays::kCountBits;
      const bool listed = count >= 2 && count <= Arrays::kMostListed;
      all_.voxels.push_back(listed ? Word(Place(block.lists, value, count), count) : word);
    }
  }
  Words Take() { return std::move(all_); }

 private:
  std::size_t Place(const std::vector<std::uint32_t>& lists, std::size_t first, std::size_t count) {
    const auto begin = lists.begin() + static_cast<std::ptrdiff_t>(first);
    std::vector<std::uint32_t> list(begin, begin + static_cast<std::ptrdiff_t>(count));
    const auto [known, added] = places_.try_emplace(std::move(list), all_.lists.size());
    if (added) all_.lists.insert(all_.lists.end(), known->first.begin(), known->first.end());
    return known->second;
  }

  Words all_;
  std::map<std::vector<std::uint32_t>, std::size_t> places_;
};

// Nothing if it would take more than kMaxWords.
std::optional<Words> Fill(const TriangleIndex& surface, const Layout& layout) {
  if (layout.count() > kMaxWords) return std::nullopt;
  std::vector<Words> blocks(BlockCount(layout.count(), kBricksOfBlock));
  std::atomic<std::size_t> words = layout.count();
  ForEachBlock(layout.count(), kBricksOfBlock, 0, [&](std::size_t block, std::size_t begin, std::size_t end) {
    std::uint32_t hint = TriangleIndex::kNoTriangle;
    for (std::size_t brick = begin; brick < end && words <= kMaxWords; ++brick) {
      AddBrick(surface, layout, brick, blocks[block], hint);
    }
    words += blocks[block].voxels.size() + blocks[block].lists.size();
  });
  if (words > kMaxWords) return std::nullopt;
  Joiner joiner;
  for (const Words& block : blocks) joiner.Append(block);
  return joiner.Take();
}

std::optional<Layout> LayoutOf(const Eigen::Vector3f& low, const Eigen::Vector3f& high,
                               const SurfaceGrid::Size& size) {
  Layout layout{low - Eigen::Vector3f::Constant(size.margin_mm), size.voxel_mm, {}};
  double bricks = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double along =
        std::ceil((static_cast<double>(high[axis]) - low[axis] + 2.0 * size.margin_mm) / layout.brick_mm());
    bricks *= std::max(along, 1.0);
    if (!(bricks <= static_cast<double>(kMaxWords))) return std::nullopt;
    layout.bricks[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(std::max(along, 1.0));
  }
  return layout;
}

SurfaceGrid Own(Words words, const Layout& layout) {
  const auto owned = std::make_shared<const Words>(std::move(words));
  return {{layout.low, layout.voxel_mm, SurfaceGrid::kBand_mm, layout.bricks, owned->tops, owned->voxels,
           owned->lists},
          owned};
}

}  // namespace

Result<SurfaceGrid> BuildSurfaceGrid(const TriangleIndex& surface, const Eigen::Vector3f& low,
                                     const Eigen::Vector3f& high, const SurfaceGrid::Size& size) {
  if (!(size.voxel_mm > 0 && size.margin_mm > 0 && std::isfinite(size.voxel_mm) &&
        std::isfinite(size.margin_mm) && (high - low).allFinite())) {
    return Fail(ErrorCode::kInvalidArgument,
                "a grid with voxels of {} mm and a margin of {} mm, expected > 0", size.voxel_mm,
                size.margin_mm);
  }
  if (surface.size() >= kMaxTriangles) {
    return Fail(ErrorCode::kInvalidArgument, "a grid of {} triangles, at most {} are possible",
                surface.size(), kMaxTriangles - 1);
  }
  // What lies outside must be farther from the surface than the band.
  SurfaceGrid::Size wider{size.voxel_mm, std::max(size.margin_mm, 2 * SurfaceGrid::kBand_mm)};
  for (;; wider.voxel_mm *= 2) {
    const auto layout = LayoutOf(low, high, wider);
    if (!layout) continue;
    if (auto words = Fill(surface, *layout)) return Own(std::move(*words), *layout);
  }
}

}  // namespace forgescan
