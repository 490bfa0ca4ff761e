#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "services/common/features/deviation_surface.h"

namespace forgescan {
namespace {

constexpr std::size_t kLeastLeaves = 512;  // with fewer the tree is as quick
constexpr std::size_t kMostCells = 4'000'000;
constexpr std::size_t kMostNodes = 12;  // of a cell; with more the tree is as quick
constexpr float kBandCells = 2;         // cells whose middle is farther from the surface have no list
constexpr float kRounding_mm = 1e-3F;
constexpr float kBoxRounding_mm = 1e-3F;
constexpr float kRootOf3 = 1.7320508F;

}  // namespace

// Makes the lists of leaves near a cell. A point of the cell lies at most half a diagonal from its middle, so
// what is nearest to the point is at most a whole diagonal farther from the middle than what is nearest to
// it.
class DeviationSurface::GridBuilder {
 public:
  explicit GridBuilder(const DeviationSurface& surface) : surface_(surface) {}

  Grid Build() {
    if (surface_.leaves_.size() < kLeastLeaves) return {};
    PlaceCells();
    std::vector<float> distances(static_cast<std::size_t>(grid_.count[0]));
    std::vector<Eigen::Vector3f> middles(distances.size());
    for (int z = 0; z < grid_.count[2]; ++z) {
      for (int y = 0; y < grid_.count[1]; ++y) {
        for (int x = 0; x < grid_.count[0]; ++x) {
          const Eigen::Vector3f at(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
          middles[static_cast<std::size_t>(x)] = grid_.low + (at.array() + 0.5F).matrix() * cell_mm_;
        }
        surface_.Deviations(middles, kBandCells * cell_mm_, distances);
        for (std::size_t i = 0; i < middles.size(); ++i) AddCell(middles[i], std::abs(distances[i]));
      }
    }
    return std::move(grid_);
  }

 private:
  inline static const Eigen::AlignedBox3f kNowhere{Eigen::Vector3f::Constant(kFarAway_mm),
                                                   Eigen::Vector3f::Constant(kFarAway_mm)};

  // Cells about as large as the leaves; all over the surface and a little about it.
  void PlaceCells() {
    Eigen::AlignedBox3f box;
    double leaf_mm = 0;
    for (const Node& node : surface_.nodes_) {
      for (std::size_t lane = 0; lane < kWidth; ++lane) {
        if (node.child[lane] >= 0) continue;
        const Eigen::AlignedBox3f leaf(Low(node, lane), High(node, lane));
        box.extend(leaf);
        leaf_mm += static_cast<double>(leaf.diagonal().norm());
      }
    }
    leaf_mm /= static_cast<double>(surface_.leaves_.size());
    cell_mm_ = static_cast<float>(std::max(leaf_mm, 1e-3));
    for (;; cell_mm_ *= 1.25F) {
      grid_.low = box.min().array() - kBandCells * cell_mm_;
      const Eigen::Array3f cells = (box.sizes().array() + 2 * kBandCells * cell_mm_) / cell_mm_;
      double product = 1;
      for (int i = 0; i < 3; ++i) product *= std::ceil(static_cast<double>(cells[i]));
      if (product > static_cast<double>(kMostCells)) continue;
      for (int i = 0; i < 3; ++i) grid_.count[i] = static_cast<int>(std::ceil(cells[i]));
      break;
    }
    grid_.cells_per_mm = 1 / cell_mm_;
  }

  static Eigen::Vector3f Low(const Node& node, std::size_t lane) {
    return {node.low[0][lane], node.low[1][lane], node.low[2][lane]};
  }
  static Eigen::Vector3f High(const Node& node, std::size_t lane) {
    return {node.high[0][lane], node.high[1][lane], node.high[2][lane]};
  }

  void AddCell(const Eigen::Vector3f& middle, float distance_mm) {
    grid_.cell_at.push_back(-1);
    if (std::isnan(distance_mm)) return;
    near_.clear();
    const float reach = distance_mm + kRootOf3 * cell_mm_ + kRounding_mm;
    Gather(0, middle, reach * reach);
    if (near_.size() > kMostNodes * kWidth) return;
    Cell cell{};
    const Axes axes = AxesAlong(near_);
    for (int i = 0; i < 3; ++i) cell.middle[i] = middle[i];
    std::copy(axes.data(), axes.data() + 9, cell.axes);
    cell.first = static_cast<std::uint32_t>(grid_.nodes.size());
    boxes_.clear();
    for (const std::int32_t leaf : near_) {
      const Eigen::AlignedBox3f box = BoxOf(leaf, middle, axes);
      boxes_.push_back({box.exteriorDistance(Eigen::Vector3f(0, 0, 0)), leaf, box});
    }
    std::sort(boxes_.begin(), boxes_.end(), [](const NearLeaf& a, const NearLeaf& b) {
      return std::pair(a.distance_mm, a.leaf) < std::pair(b.distance_mm, b.leaf);
    });
    for (std::size_t begin = 0; begin < boxes_.size(); begin += kWidth) {
      Node node;
      for (std::size_t lane = 0; lane < kWidth; ++lane) {
        const bool is_there = begin + lane < boxes_.size();
        const NearLeaf& near = boxes_[is_there ? begin + lane : 0];
        node.child[lane] = ~near.leaf;
        PlaceBox(is_there ? near.box : kNowhere, lane, node);
      }
      grid_.nodes.push_back(node);
      grid_.nearest_mm.push_back(std::max(boxes_[begin].distance_mm - kBoxRounding_mm, 0.0F));
    }
    cell.last = static_cast<std::uint32_t>(grid_.nodes.size());
    grid_.cell_at.back() = static_cast<std::int32_t>(grid_.cells.size());
    grid_.cells.push_back(cell);
  }

  using Axes = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;

  // The last axis is the mean normal of the leaves; any will do where they have none.
  Axes AxesAlong(const std::vector<std::int32_t>& leaves) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const std::int32_t number : leaves) {
      const Leaf& leaf = surface_.leaves_[static_cast<std::size_t>(number)];
      for (int i = 0; i < 3; ++i) sum[i] += Eigen::Map<const Eigen::Array<float, 8, 1>>(leaf.normal[i]).sum();
    }
    Axes axes = Axes::Identity();
    if (!(sum.norm() > 0.5F)) return axes;
    const Eigen::Vector3f normal = sum.normalized();
    axes.row(2) = normal;
    axes.row(0) = normal.unitOrthogonal();
    axes.row(1) = normal.cross(Eigen::Vector3f(axes.row(0)));
    return axes;
  }

  // Of the leaf's corners in the frame, and what rounding may put outside. Lanes without a triangle repeat
  // the first.
  Eigen::AlignedBox3f BoxOf(std::int32_t number, const Eigen::Vector3f& middle, const Axes& axes) const {
    const Leaf& leaf = surface_.leaves_[static_cast<std::size_t>(number)];
    using Eight = Eigen::Array<float, 3, 8, Eigen::RowMajor>;
    Eight corner = Eigen::Map<const Eight>(&leaf.corner[0][0]);
    const Eight ab = Eigen::Map<const Eight>(&leaf.ab[0][0]), ac = Eigen::Map<const Eight>(&leaf.ac[0][0]);
    for (int lane = 1; lane < 8; ++lane) {
      if (corner(0, lane) == kFarAway_mm) corner.col(lane) = corner.col(0);
    }
    corner.colwise() -= middle.array();
    Eigen::AlignedBox3f box;
    for (int axis = 0; axis < 3; ++axis) {
      const auto along = [&](const Eight& at) -> Eigen::Array<float, 1, 8> {
        return axes(axis, 0) * at.row(0) + axes(axis, 1) * at.row(1) + axes(axis, 2) * at.row(2);
      };
      const Eigen::Array<float, 1, 8> a = along(corner), b = a + along(ab), c = a + along(ac);
      box.min()[axis] = a.min(b).min(c).minCoeff() - kBoxRounding_mm;
      box.max()[axis] = a.max(b).max(c).maxCoeff() + kBoxRounding_mm;
    }
    return box;
  }

  static void PlaceBox(const Eigen::AlignedBox3f& box, std::size_t lane, Node& node) {
    for (int i = 0; i < 3; ++i) {
      node.low[i][lane] = box.min()[i];
      node.high[i][lane] = box.max()[i];
    }
  }

  // The leaves whose boxes are within reach of the place, in the order of the tree.
  void Gather(std::int32_t number, const Eigen::Vector3f& place, float squared_reach) {
    const Node& node = surface_.nodes_[static_cast<std::size_t>(number)];
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      const Eigen::Vector3f low = Low(node, lane), high = High(node, lane);
      if ((low - place).cwiseMax(place - high).cwiseMax(0.0F).squaredNorm() > squared_reach) continue;
      if (node.child[lane] >= 0) {
        Gather(node.child[lane], place, squared_reach);
      } else {
        near_.push_back(~node.child[lane]);
      }
    }
  }

  struct NearLeaf {
    float distance_mm;  // of its box from the middle of the cell
    std::int32_t leaf;
    Eigen::AlignedBox3f box;
  };

  const DeviationSurface& surface_;
  Grid grid_;
  float cell_mm_ = 1;
  std::vector<std::int32_t> near_;
  std::vector<NearLeaf> boxes_;
};

DeviationSurface::Grid DeviationSurface::MakeGrid() const { return GridBuilder(*this).Build(); }

}  // namespace forgescan
