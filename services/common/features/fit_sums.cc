#include "services/common/features/fit_sums.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "services/common/simd_target.h"

// Compiled with -ffp-contract=off: a fused product would differ between the paths.

namespace forgescan {
namespace {

#define FORGESCAN_INLINE [[gnu::always_inline]] inline

constexpr std::size_t kLanes = 8;
constexpr std::size_t kBlock = 512;  // points; 12 kB of columns stay in the first cache
constexpr double kHuge = std::numeric_limits<double>::max();

using Lanes = double __attribute__((vector_size(sizeof(double) * kLanes)));
using Bits = long long __attribute__((vector_size(sizeof(double) * kLanes)));

FORGESCAN_INLINE Lanes All(double value) {
  return Lanes{value, value, value, value, value, value, value, value};
}
FORGESCAN_INLINE Lanes Absolute(Lanes x) {
  return reinterpret_cast<Lanes>(reinterpret_cast<Bits>(x) & std::numeric_limits<long long>::max());
}
FORGESCAN_INLINE Lanes Root(Lanes x) {
  for (std::size_t i = 0; i < kLanes; ++i) x[i] = __builtin_sqrt(x[i]);
  return x;
}
FORGESCAN_INLINE double Total(Lanes x) {
  return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]));
}

// Residual and row of eight points, from their coordinates in the shape's own axes.
template <int K>
struct Rows {
  Lanes residual;
  Lanes row[K];
};

FORGESCAN_INLINE void Fill(const PlaneSums& plane, Lanes u, Lanes v, Lanes w, Rows<3>& rows) {
  rows.residual = w;
  rows.row[0] = All(1);
  rows.row[1] = u * plane.per_mm;
  rows.row[2] = v * plane.per_mm;
}

FORGESCAN_INLINE void Fill(const CylinderSums& cylinder, Lanes u, Lanes v, Lanes w, Rows<5>& rows) {
  const Lanes distance = Root(u * u + v * v);
  rows.residual = distance - cylinder.radius_mm;
  const Lanes t = w * cylinder.per_mm;
  rows.row[0] = u / distance;
  rows.row[1] = v / distance;
  rows.row[2] = t * rows.row[0];
  rows.row[3] = t * rows.row[1];
  rows.row[4] = All(1);
}

FORGESCAN_INLINE void Fill(const ConeSums& cone, Lanes u, Lanes v, Lanes w, Rows<6>& rows) {
  const Lanes distance = Root(u * u + v * v);
  const Lanes off = distance - cone.radius_mm;
  rows.residual = off * cone.cosine - w * cone.sine;
  const Lanes x = u / distance, y = v / distance;
  const Lanes lever = (w * cone.cosine + distance * cone.sine) * cone.per_mm;
  rows.row[0] = x * cone.cosine;
  rows.row[1] = y * cone.cosine;
  rows.row[2] = x * lever;
  rows.row[3] = y * lever;
  rows.row[4] = All(cone.cosine);
  rows.row[5] = (off * cone.sine + w * cone.cosine) * cone.per_mm;
}

FORGESCAN_INLINE void Fill(const SphereSums& sphere, Lanes u, Lanes v, Lanes w, Rows<4>& rows) {
  const Lanes distance = Root((u * u + v * v) + w * w);
  rows.residual = distance - sphere.radius_mm;
  rows.row[0] = u / distance;
  rows.row[1] = v / distance;
  rows.row[2] = w / distance;
  rows.row[3] = All(1);
}

// The coordinates of one block, one array each; the last eight are filled up with NaN, which nothing uses.
struct Columns {
  alignas(64) double x[kBlock], y[kBlock], z[kBlock];
  std::size_t groups;

  FORGESCAN_INLINE void Take(const Eigen::Vector3d* points, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = points[i].data()[0];
      y[i] = points[i].data()[1];
      z[i] = points[i].data()[2];
    }
    groups = (count + kLanes - 1) / kLanes;
    for (std::size_t i = count; i < groups * kLanes; ++i) x[i] = y[i] = z[i] = std::nan("");
  }
};

// The frame as plain numbers, in registers.
struct Axes {
  double at[3], u[3], v[3], w[3];

  explicit Axes(const FitFrame& frame) {
    for (int i = 0; i < 3; ++i) {
      at[i] = frame.origin[i];
      u[i] = frame.axes(i, 0);
      v[i] = frame.axes(i, 1);
      w[i] = frame.axes(i, 2);
    }
  }
};

template <typename Shape>
FORGESCAN_INLINE Lanes FillGroup(const Columns& columns, std::size_t group, const Axes& a, const Shape& shape,
                                 Rows<Shape::kUnknowns>& rows) {
  const auto load = [](const double* from) { return *reinterpret_cast<const Lanes*>(from); };
  const Lanes x = load(columns.x + group * kLanes) - a.at[0];
  const Lanes y = load(columns.y + group * kLanes) - a.at[1];
  const Lanes z = load(columns.z + group * kLanes) - a.at[2];
  const Lanes w = (x * a.w[0] + y * a.w[1]) + z * a.w[2];
  Fill(shape, (x * a.u[0] + y * a.u[1]) + z * a.u[2], (x * a.v[0] + y * a.v[1]) + z * a.v[2], w, rows);
  return w;
}

template <int K>
struct LaneSums {
  Lanes normal[K * (K + 1) / 2], right[K], squares, along, used, finite, lowest, highest;

  FORGESCAN_INLINE void Clear() {
    for (Lanes& sum : normal) sum = All(0);
    for (Lanes& sum : right) sum = All(0);
    squares = along = used = finite = All(0);
    lowest = All(kHuge);
    highest = All(-kHuge);
  }

  FORGESCAN_INLINE void Add(const Rows<K>& rows, Lanes w, double limit) {
    // A point on the axis itself has no direction: its row is not a number, and then neither is its size.
    // Every choice compares for itself: GCC makes one masked move of that, but not of a mask put together.
    const Lanes size = Absolute(rows.residual) + (rows.row[0] - rows.row[0]);
    const Lanes zero = All(0), r = size <= limit ? rows.residual : zero;
    Lanes row[K];
    for (int i = 0; i < K; ++i) row[i] = size <= limit ? rows.row[i] : zero;
    for (int i = 0, at = 0; i < K; ++i) {
      for (int j = i; j < K; ++j, ++at) normal[at] += row[i] * row[j];
      right[i] += row[i] * r;
    }
    squares += r * r;
    along += size <= limit ? w : zero;
    used += size <= limit ? All(1) : zero;
    finite += size <= kHuge ? All(1) : zero;
    const Lanes low = size <= limit ? rows.residual : All(kHuge);
    const Lanes high = size <= limit ? rows.residual : All(-kHuge);
    lowest = low < lowest ? low : lowest;
    highest = high > highest ? high : highest;
  }

  FORGESCAN_INLINE void AddTo(NormalSums<K>& sums) const {
    for (int i = 0, at = 0; i < K; ++i) {
      for (int j = i; j < K; ++j, ++at) sums.normal.data()[i * K + j] += Total(normal[at]);
      sums.right.data()[i] += Total(right[i]);
    }
    sums.squares += Total(squares);
    sums.along += Total(along);
    sums.used += static_cast<std::size_t>(Total(used));
    sums.finite += static_cast<std::size_t>(Total(finite));
    for (std::size_t i = 0; i < kLanes; ++i) {
      if (lowest[i] < sums.lowest) sums.lowest = lowest[i];
      if (highest[i] > sums.highest) sums.highest = highest[i];
    }
  }
};

template <typename Shape>
struct SumJob {
  const Eigen::Vector3d* points;
  std::size_t count;
  const Axes& axes;
  const Shape& shape;
  double limit_mm;
  NormalSums<Shape::kUnknowns>& sums;

  FORGESCAN_INLINE void Run() const {
    Columns columns;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
      columns.Take(points + begin, count - begin < kBlock ? count - begin : kBlock);
      LaneSums<Shape::kUnknowns> block;
      block.Clear();
      for (std::size_t group = 0; group < columns.groups; ++group) {
        Rows<Shape::kUnknowns> rows;
        const Lanes w = FillGroup(columns, group, axes, shape, rows);
        block.Add(rows, w, limit_mm);
      }
      block.AddTo(sums);
    }
  }
};

template <typename Shape>
struct ResidualJob {
  const Eigen::Vector3d* points;
  std::size_t count;
  const Axes& axes;
  const Shape& shape;
  float* residuals;

  FORGESCAN_INLINE void Run() const {
    Columns columns;
    for (std::size_t begin = 0; begin < count; begin += kBlock) {
      const std::size_t size = count - begin < kBlock ? count - begin : kBlock;
      columns.Take(points + begin, size);
      for (std::size_t group = 0; group < columns.groups; ++group) {
        Rows<Shape::kUnknowns> rows;
        FillGroup(columns, group, axes, shape, rows);
        const Lanes absolute = Absolute(rows.residual);
        for (std::size_t i = 0; i < kLanes && group * kLanes + i < size; ++i) {
          residuals[begin + group * kLanes + i] = static_cast<float>(absolute[i]);
        }
      }
    }
  }
};

template <typename Job>
FORGESCAN_TARGET_AVX512 void RunAvx512(const Job& job) {
  job.Run();
}
template <typename Job>
FORGESCAN_TARGET_AVX2 void RunAvx2(const Job& job) {
  job.Run();
}

template <typename Job>
void RunOn(SimdPath path, const Job& job) {
  if (path == SimdPath::kAvx512) return RunAvx512(job);
  if (path == SimdPath::kAvx2) return RunAvx2(job);
  job.Run();
}

}  // namespace

template <typename Shape>
NormalSums<Shape::kUnknowns> SumRows(std::span<const Eigen::Vector3d> points, const FitFrame& frame,
                                     const Shape& shape, double limit_mm, SimdPath path) {
  NormalSums<Shape::kUnknowns> sums;
  sums.lowest = kHuge;
  sums.highest = -kHuge;
  const Axes axes(frame);
  RunOn(path, SumJob<Shape>{points.data(), points.size(), axes, shape, std::min(limit_mm, kHuge), sums});
  if (sums.used == 0) sums.lowest = sums.highest = 0;
  // The columns of the symmetric matrix hold its lower half; the upper one follows.
  sums.normal = sums.normal.template selfadjointView<Eigen::Lower>().toDenseMatrix();
  return sums;
}

template <typename Shape>
std::vector<float> AbsoluteResiduals(std::span<const Eigen::Vector3d> points, const FitFrame& frame,
                                     const Shape& shape, SimdPath path) {
  std::vector<float> residuals(points.size());
  const Axes axes(frame);
  RunOn(path, ResidualJob<Shape>{points.data(), points.size(), axes, shape, residuals.data()});
  return residuals;
}

#define FORGESCAN_FIT_SHAPE(Shape)                                                                 \
  template NormalSums<Shape::kUnknowns> SumRows(std::span<const Eigen::Vector3d>, const FitFrame&, \
                                                const Shape&, double, SimdPath);                   \
  template std::vector<float> AbsoluteResiduals(std::span<const Eigen::Vector3d>, const FitFrame&, \
                                                const Shape&, SimdPath);
FORGESCAN_FIT_SHAPE(PlaneSums)
FORGESCAN_FIT_SHAPE(CylinderSums)
FORGESCAN_FIT_SHAPE(ConeSums)
FORGESCAN_FIT_SHAPE(SphereSums)

}  // namespace forgescan
