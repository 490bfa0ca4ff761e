#include "tests/services/report/sample_report.h"

#include <cmath>
#include <numbers>

namespace forgescan {
namespace {

void AddTube(PointCloud& cloud, Eigen::Vector2d span_x, double radius_mm, double spacing_mm) {
  const int around = static_cast<int>(2.0 * std::numbers::pi * radius_mm / spacing_mm);
  for (double x = span_x[0]; x <= span_x[1]; x += spacing_mm) {
    for (int i = 0; i < around; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / around;
      const Eigen::Vector3d normal(0.0, std::cos(angle), std::sin(angle));
      cloud.points.emplace_back((Eigen::Vector3d(x, 0, 0) + radius_mm * normal).cast<float>());
      cloud.normals.emplace_back(normal.cast<float>());
    }
  }
}

void AddPlate(PointCloud& cloud, double middle_x, const Eigen::Vector3d& half, double spacing_mm) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (double a = -half[u]; a <= half[u]; a += spacing_mm) {
      for (double b = -half[v]; b <= half[v]; b += spacing_mm) {
        for (const double side : {-1.0, 1.0}) {
          Eigen::Vector3d point(middle_x, 0, 0);
          point[axis] += side * half[axis];
          point[u] += a;
          point[v] += b;
          Eigen::Vector3d normal = Eigen::Vector3d::Zero();
          normal[axis] = side;
          cloud.points.emplace_back(point.cast<float>());
          cloud.normals.emplace_back(normal.cast<float>());
        }
      }
    }
  }
}

HistoryPoint Value(int index, double measured_mm, Verdict verdict) {
  return {index,  100 + index, 1'700'000'000'000'000 + 45'000'000LL * index,
          1888.0, measured_mm, 1887.0,
          1889.0, 0.24,        900.0,
          verdict};
}

ReportedTrend SampleTrend(const std::string& name, int count, double slope_mm) {
  ReportedTrend trend{name, {}, {}, {}};
  std::vector<TrendPoint> values;
  for (int i = 1; i <= count; ++i) {
    const double value_mm = 1888.3 + slope_mm * i + 0.06 * std::sin(2.7 * i);
    const Verdict verdict = JudgeSize(value_mm, 0.24, 1887.0, 1889.0);
    trend.points.push_back(
        Value(i, i == 4 ? kNotKnown : value_mm, i == 4 ? Verdict::kNotInspected : verdict));
    if (i != 4) {
      values.push_back({static_cast<double>(i), value_mm});
    }
  }
  if (const auto fitted = FitTrend(values); fitted.ok()) {
    trend.trend = *fitted;
    trend.parts_to_limit = PartsToLimit(*fitted, {1887.0, 1889.0, 0.24}, count);
  }
  return trend;
}

JudgedDimension Dimension(const std::string& name, Eigen::Vector3d size, double uncertainty_mm) {
  JudgedDimension to;
  to.name = name;
  to.nominal_mm = size[0];
  to.measured_mm = size[0] + size[1];
  to.deviation_mm = size[1];
  to.lower_mm = size[0] - size[2];
  to.upper_mm = size[0] + size[2];
  to.uncertainty_mm = uncertainty_mm;
  to.temperature_degc = 900.0;
  to.points = 23456;
  to.rejected_share = 0.0123;
  to.verdict = JudgeSize(to.measured_mm, to.uncertainty_mm, to.lower_mm, to.upper_mm);
  return to;
}

std::vector<JudgedDimension> SampleDimensions() {
  std::vector<JudgedDimension> all = {Dimension("total length", {1888.0, -0.8123, 1.0}, 0.2413),
                                      Dimension("right plate width", {177.5, 0.0712, 0.5}, 0.0856),
                                      Dimension("right cylinder diameter", {88.5, -0.0198, 0.4}, 0.0751),
                                      Dimension("left plate width", {178.9, 0.6412, 0.5}, 0.0856),
                                      Dimension("left cylinder diameter", {89.7, 0.0, 0.4}, 0.0751)};
  JudgedDimension& last = all.back();
  last.measured_mm = last.deviation_mm = last.uncertainty_mm = kNotKnown;
  last.verdict = Verdict::kNotInspected;
  last.reason = "The points cover 121 degrees of the cylinder, 150 degrees are needed.";
  return all;
}

}  // namespace

PointCloud SampleAxle(double spacing_mm) {
  PointCloud cloud;
  AddTube(cloud, {-944.0, -760.0}, 44.85, spacing_mm);
  AddTube(cloud, {-760.0, 760.0}, 34.0, spacing_mm);
  AddTube(cloud, {760.0, 944.0}, 44.25, spacing_mm);
  AddPlate(cloud, -520.0, {60.0, 89.0, 18.0}, spacing_mm);
  AddPlate(cloud, 520.0, {60.0, 89.0, 18.0}, spacing_mm);
  cloud.sigma_mm.assign(cloud.size(), 0.02F);
  cloud.view.assign(cloud.size(), 0);
  return cloud;
}

std::vector<float> SampleDeviations(const PointCloud& cloud) {
  std::vector<float> deviations;
  for (const Eigen::Vector3f& point : cloud.points) {
    deviations.push_back(0.8F * std::sin(point.x() / 944.0F * 1.5707963F));
  }
  return deviations;
}

PartReport SampleReport(int count) {
  PartReport report;
  report.station = "Forge <2> & \"press\" A";
  report.software_version = "0.1.0";
  report.config_hash = "89abcdef";
  report.part = 100 + count;
  report.arrived_utime = 1'700'000'000'000'000;
  report.last_view_utime = 1'700'000'027'000'000;
  report.verdict_utime = 1'700'000'029'250'000;
  report.dimensions = SampleDimensions();
  report.verdict = JudgePart(report.dimensions);
  report.reference_degc = 900.0;
  report.registration = {
      "CONVERGED", "",    21,     0.0312, 0.771,
      0.2213,      3.412, 0.0071, 0.0213, {1, 0, 0, 3.25, 0, 1, 0, -1, 0, 0, 1, 0.5, 0, 0, 0, 1}};
  for (int i = 0; i < 10; ++i) {
    report.views.push_back({i, "OK", "", 1'700'000'000'000'000 + 2'700'000LL * (i + 1), 915.0 - 1.6 * i,
                            1.0 - 2e-5 * (15.0 - 1.6 * i), 213456 - 1000 * i, 71.5, 0.0312});
  }
  report.views[6] = {6, "VOID",    "3 of 16 frames of the right camera did not arrive.",
                     0, kNotKnown, kNotKnown,
                     0, kNotKnown, kNotKnown};
  report.timing_s = {27.0, 0.61, 0.082, 0.31, 0.12, 2.25};
  report.counters = {160, 157, 3, 3, 1};
  report.trends = {SampleTrend("total length", count, -0.03), SampleTrend("right plate width", count, 0.0),
                   SampleTrend("right cylinder diameter", 5, -0.02)};
  return report;
}

}  // namespace forgescan
