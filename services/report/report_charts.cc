#include "services/report/report_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "services/report/report_text.h"

namespace forgescan {
namespace {

// A linear axis from values to pixels.
struct Axis {
  double from, to;  // values at the ends
  double start_px, end_px;
  double Px(double value) const { return start_px + (value - from) / (to - from) * (end_px - start_px); }
  double Clamped(double value) const { return Px(std::clamp(value, std::min(from, to), std::max(from, to))); }
};

// Verdicts differ in shape too: a print in grey still tells them apart.
std::string Marker(double x, double y, Verdict verdict, double r) {
  const std::string kind = VerdictClass(verdict);
  if (verdict == Verdict::kNotOk) {
    return fmt::format("<path class=\"m {}\" d=\"M{:.1f} {:.1f}l{} {}l-{} {}l-{} -{}z\"/>", kind, x,
                       y - 1.25 * r, 1.25 * r, 1.25 * r, 1.25 * r, 1.25 * r, 1.25 * r, 1.25 * r);
  }
  if (verdict == Verdict::kNotDecidable) {
    return fmt::format("<path class=\"m {}\" d=\"M{:.1f} {:.1f}l{} {}h-{}z\"/>", kind, x, y - 1.2 * r,
                       1.2 * r, 2.1 * r, 2.4 * r);
  }
  return fmt::format("<circle class=\"m {}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", kind, x, y, r);
}

std::string Line(const char* kind, double x1, double y1, double x2, double y2) {
  return fmt::format("<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>", kind, x1,
                     y1, x2, y2);
}

std::string Rect(const char* kind, double x1, double x2, double y, double height) {
  return fmt::format("<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                     kind, x1, y, std::max(0.0, x2 - x1), height);
}

std::string Label(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", x, y, anchor, text);
}

// Plot area of a trend chart, px.
constexpr double kWidth = 360, kHeight = 176, kLeft = 62, kRight = 350, kTop = 10, kBottom = 152;

Axis ValueAxis(const ReportedTrend& trend) {
  double low = trend.points.back().lower_mm;
  double high = trend.points.back().upper_mm;
  for (const HistoryPoint& point : trend.points) {
    if (std::isfinite(point.measured_mm)) {
      low = std::min(low, point.measured_mm);
      high = std::max(high, point.measured_mm);
    }
  }
  const double room = std::max(0.08 * (high - low), 1e-3);
  return {low - room, high + room, kBottom, kTop};
}

std::string LimitLines(const ReportedTrend& trend, const Axis& y) {
  const HistoryPoint& newest = trend.points.back();
  std::string svg =
      Rect("inside", kLeft, kRight, y.Px(newest.upper_mm), y.Px(newest.lower_mm) - y.Px(newest.upper_mm));
  for (const double limit_mm : {newest.upper_mm, newest.lower_mm}) {
    svg += Line("limit", kLeft, y.Px(limit_mm), kRight, y.Px(limit_mm));
    svg += Label(kLeft - 6, y.Px(limit_mm) + 4, "end", NumberText(limit_mm, 2));
  }
  const double nominal_px = y.Clamped(newest.nominal_mm);
  svg += Line("nominal", kLeft, nominal_px, kRight, nominal_px);
  const bool room = nominal_px - y.Px(newest.upper_mm) > 14 && y.Px(newest.lower_mm) - nominal_px > 14;
  return room ? svg + Label(kLeft - 6, nominal_px + 4, "end", NumberText(newest.nominal_mm, 2)) : svg;
}

std::string TrendLine(const Trend& trend, const Axis& x, const Axis& y) {
  // Drawn over the parts it was fitted to: an extrapolation would look like a measurement.
  const double from = x.from + 0.5;
  const double to = x.to - 0.5;
  return Line("trend", x.Px(from), y.Clamped(trend.At(from)), x.Px(to), y.Clamped(trend.At(to)));
}

std::string Unmeasured(double x) {
  return fmt::format("<path class=\"m none\" d=\"M{:.1f} {:.1f}l6 6m0 -6l-6 6\"/>", x - 3, kBottom - 9);
}

}  // namespace

std::string VerdictClass(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "ok";
    case Verdict::kNotOk:
      return "not-ok";
    case Verdict::kNotDecidable:
      return "not-decidable";
    default:
      return "not-inspected";
  }
}

std::string VerdictLabel(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "OK";
    case Verdict::kNotOk:
      return "Not OK";
    case Verdict::kNotDecidable:
      return "Not decidable";
    default:
      return "Not inspected";
  }
}

std::string LimitsChart(const JudgedDimension& dimension) {
  constexpr double kBarWidth = 150, kBarHeight = 26, kTrackTop = 8, kTrackHeight = 10, kMiddle = 13;
  const double tolerance_mm = dimension.upper_mm - dimension.lower_mm;
  std::string svg =
      fmt::format("<svg class=\"bar\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"place within limits\">",
                  kBarWidth, kBarHeight);
  if (!std::isfinite(tolerance_mm) || tolerance_mm <= 0.0) {
    return svg + "</svg>";
  }
  const double room_mm = 0.35 * tolerance_mm;
  const Axis x{dimension.lower_mm - room_mm, dimension.upper_mm + room_mm, 4, kBarWidth - 4};
  svg += Rect("outside", x.start_px, x.end_px, kTrackTop, kTrackHeight);
  svg += Rect("guard", x.Px(dimension.lower_mm), x.Px(dimension.upper_mm), kTrackTop, kTrackHeight);
  const double guard_mm = std::isfinite(dimension.uncertainty_mm) ? dimension.uncertainty_mm : 0.0;
  if (2.0 * guard_mm < tolerance_mm) {
    svg += Rect("inside", x.Px(dimension.lower_mm + guard_mm), x.Px(dimension.upper_mm - guard_mm), kTrackTop,
                kTrackHeight);
  }
  for (const double limit_mm : {dimension.lower_mm, dimension.upper_mm}) {
    svg += Line("limit", x.Px(limit_mm), 3, x.Px(limit_mm), kBarHeight - 5);
  }
  if (std::isfinite(dimension.measured_mm)) {
    const double value = dimension.measured_mm;
    svg += Line("whisker", x.Clamped(value - guard_mm), kMiddle, x.Clamped(value + guard_mm), kMiddle);
    svg += Marker(x.Clamped(value), kMiddle, dimension.verdict, 4.5);
  }
  return svg + "</svg>";
}

std::string TrendChart(const ReportedTrend& trend) {
  std::string svg = fmt::format("<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\">", kWidth, kHeight);
  if (trend.points.empty()) {
    return svg + Label(kWidth / 2, kHeight / 2, "middle", "no values yet") + "</svg>";
  }
  const HistoryPoint& newest = trend.points.back();
  const Axis x{static_cast<double>(trend.points.front().part_index) - 0.5,
               static_cast<double>(newest.part_index) + 0.5, kLeft, kRight};
  const Axis y = ValueAxis(trend);
  svg += LimitLines(trend, y);
  if (trend.trend.has_value() && trend.trend->significant) {
    svg += TrendLine(*trend.trend, x, y);
  }
  for (const HistoryPoint& point : trend.points) {
    const double at_px = x.Px(static_cast<double>(point.part_index));
    svg += std::isfinite(point.measured_mm) ? Marker(at_px, y.Px(point.measured_mm), point.verdict, 3.4)
                                            : Unmeasured(at_px);
  }
  if (std::isfinite(newest.measured_mm)) {
    svg += fmt::format("<circle class=\"ring\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"7.5\"/>",
                       x.Px(static_cast<double>(newest.part_index)), y.Px(newest.measured_mm));
  }
  svg += Line("axis", kLeft, kBottom, kRight, kBottom);
  svg += Label(x.Px(static_cast<double>(newest.part_index)), kHeight - 8, "end",
               fmt::format("part {}", newest.part));
  if (trend.points.size() > 1) {
    svg += Label(kLeft, kHeight - 8, "start", fmt::format("part {}", trend.points.front().part));
  }
  return svg + "</svg>";
}

std::string TrendSentence(const ReportedTrend& trend) {
  if (!trend.trend.has_value() || trend.trend->count < kTrendMinParts) {
    return fmt::format("Fewer than {} measured parts: no trend yet.", kTrendMinParts);
  }
  const Trend& line = *trend.trend;
  if (!line.significant) {
    return fmt::format("No significant trend over {} parts; part to part {} mm (one sigma).", line.count,
                       NumberText(line.individual_sigma_mm, 3));
  }
  const std::string slope =
      fmt::format("{} mm per part over {} parts", SignedText(line.slope_mm, 3), line.count);
  const char* limit = line.slope_mm > 0.0 ? "upper" : "lower";
  if (!trend.parts_to_limit.has_value()) {
    return fmt::format("Trend {}; the {} limit is far away.", slope, limit);
  }
  return *trend.parts_to_limit == 0
             ? fmt::format("Trend {}; the next part may pass the {} limit.", slope, limit)
             : fmt::format("Trend {}; {} {} to the {} limit (95\u00a0%).", slope, *trend.parts_to_limit,
                           *trend.parts_to_limit == 1 ? "part" : "parts", limit);
}

}  // namespace forgescan
