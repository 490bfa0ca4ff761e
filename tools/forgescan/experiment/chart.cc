#include "tools/forgescan/experiment/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "services/common/base64.h"

namespace forgescan {
namespace {

constexpr std::array kColours = {"#2b5fa8", "#b8281d", "#1b7f4d", "#b56a00", "#6b3fa0", "#5b6774"};
constexpr double kLegendRow = 18;
constexpr double kDotRadius = 3;
constexpr double kLeftMargin = 82;  // label and numbers of seven digits

const char* ColourOf(const Series& series) {
  return kColours[static_cast<std::size_t>(series.colour) % kColours.size()];
}

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  }
  return out;
}

std::string Text(double x, double y, const char* style, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, style, Escaped(text));
}

std::string Line(double x1, double y1, double x2, double y2, const char* style) {
  return fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" {}/>\n", x1, y1, x2, y2, style);
}

// From values to px along one axis.
struct Axis {
  bool is_log;
  double low, high, start_px, end_px;

  double Px(double value) const {
    const auto place = [this](double v) { return is_log ? std::log10(std::max(v, 1e-300)) : v; };
    const double share = (place(std::clamp(value, low, high)) - place(low)) / (place(high) - place(low));
    return start_px + share * (end_px - start_px);
  }
};

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void Add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

Axis MakeAxis(const AxisSpec& spec, Extent extent, double start_px, double end_px) {
  if (!(extent.low <= extent.high)) extent = {0, 1};
  const double room = 0.05 * std::max(extent.high - extent.low, 1e-9 + 1e-6 * std::abs(extent.high));
  double low = spec.low.value_or(spec.is_log ? extent.low / 1.2 : extent.low - room);
  const double high = spec.high.value_or(spec.is_log ? extent.high * 1.2 : extent.high + room);
  if (spec.is_log) low = std::max(low, 1e-12);
  return {spec.is_log, low, std::max(high, low + 1e-12), start_px, end_px};
}

std::vector<double> Ticks(const Axis& axis) {
  std::vector<double> ticks;
  if (axis.is_log) {
    const bool is_wide = axis.high / axis.low > 300;
    for (double decade = std::pow(10, std::floor(std::log10(axis.low))); decade <= axis.high; decade *= 10) {
      for (const double step : {1.0, 2.0, 5.0}) {
        const double tick = step * decade;
        if ((step == 1 || !is_wide) && tick >= axis.low * 0.999 && tick <= axis.high * 1.001) {
          ticks.push_back(tick);
        }
      }
    }
    return ticks;
  }
  const double wanted = (axis.high - axis.low) / 6;
  const double decade = std::pow(10, std::floor(std::log10(wanted)));
  const double step = decade * (wanted > 5 * decade ? 10 : wanted > 2 * decade ? 5 : wanted > decade ? 2 : 1);
  for (double i = std::ceil(axis.low / step - 1e-9); i * step <= axis.high + 1e-9 * step; ++i) {
    ticks.push_back(i == 0 ? 0 : i * step);
  }
  return ticks;
}

// Enough digits to tell neighbours apart, and no more.
std::string TickText(double value, const Axis& axis) {
  if (axis.is_log) return fmt::format("{:.6g}", value);
  const double step = (axis.high - axis.low) / 6;
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(step))), 0, 6);
  return fmt::format("{:.{}f}", value, digits);
}

class ChartPainter {
 public:
  ChartPainter(const Chart& chart, const Panel& panel) : chart_(chart), panel_(panel) {
    PlaceLegend();
    Extent x, y;
    for (const Series& series : chart.series) {
      for (const double value : series.x) x.Add(value);
      for (const double value : series.y) y.Add(value);
      if (series.mark == Mark::kBars) y.Add(0);
    }
    for (const GoalLine& goal : chart.goals) (goal.is_x ? x : y).Add(goal.at);
    x_ = MakeAxis(chart.x, x, panel.left + kLeftMargin, panel.left + panel.width - 16);
    y_ = MakeAxis(chart.y, y, panel.top + panel.height - 50,
                  panel.top + 34 + kLegendRow * static_cast<double>(legend_rows_));
  }

  std::string Draw() const {
    std::string svg =
        Text(panel_.left + 12, panel_.top + 20, "font-size=\"15\" font-weight=\"600\"", chart_.title);
    svg += legend_ + Grid();
    for (const Series& series : chart_.series) svg += DrawSeries(series);
    for (const GoalLine& goal : chart_.goals) svg += DrawGoal(goal);
    return svg;
  }

 private:
  void PlaceLegend() {
    constexpr double kCharacter = 6.9, kSwatch = 34;
    double x = panel_.left + kLeftMargin, y = panel_.top + 38;
    for (const Series& series : chart_.series) {
      if (series.label.empty()) continue;
      const double width = kSwatch + kCharacter * static_cast<double>(series.label.size()) + 14;
      if (legend_rows_ == 0) legend_rows_ = 1;
      if (x + width > panel_.left + panel_.width && x > panel_.left + kLeftMargin) {
        x = panel_.left + kLeftMargin;
        y += kLegendRow;
        ++legend_rows_;
      }
      legend_ += Swatch(series, x, y - 4) + Text(x + kSwatch - 6, y, "", series.label);
      x += width;
    }
  }

  static std::string Swatch(const Series& series, double x, double y) {
    const char* colour = ColourOf(series);
    switch (series.mark) {
      case Mark::kDots:
        return Dot(x + 11, y, colour);
      case Mark::kBars:
        return fmt::format("<path d=\"M{:.1f} {:.1f}h22v10h-22z\" fill=\"{}\" fill-opacity=\"0.6\"/>\n", x,
                           y - 5, colour);
      case Mark::kLineDots:
        return Stroke(fmt::format("M{:.1f} {:.1f}h22", x, y), colour, false) + Dot(x + 11, y, colour);
      default:
        return Stroke(fmt::format("M{:.1f} {:.1f}h22", x, y), colour, series.mark == Mark::kDashed);
    }
  }

  static std::string Dot(double x, double y, const char* colour) {
    return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n", x, y, kDotRadius,
                       colour);
  }
  static std::string Stroke(const std::string& path, const char* colour, bool is_dashed) {
    return fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}/>\n", path, colour,
                       is_dashed ? " stroke-dasharray=\"6 4\"" : "");
  }

  std::string Grid() const {
    constexpr const char* kGrid = "stroke=\"#dfe4ea\"";
    std::string svg;
    for (const double tick : Ticks(x_)) {
      svg += Line(x_.Px(tick), y_.start_px, x_.Px(tick), y_.end_px, kGrid);
      svg += Text(x_.Px(tick), y_.start_px + 17, "text-anchor=\"middle\"", TickText(tick, x_));
    }
    for (const double tick : Ticks(y_)) {
      svg += Line(x_.start_px, y_.Px(tick), x_.end_px, y_.Px(tick), kGrid);
      svg += Text(x_.start_px - 7, y_.Px(tick) + 4, "text-anchor=\"end\"", TickText(tick, y_));
    }
    svg += Line(x_.start_px, y_.start_px, x_.end_px, y_.start_px, "stroke=\"#5b6774\"");
    svg += Line(x_.start_px, y_.start_px, x_.start_px, y_.end_px, "stroke=\"#5b6774\"");
    const double middle = 0.5 * (y_.start_px + y_.end_px);
    svg += Text(0.5 * (x_.start_px + x_.end_px), y_.start_px + 38, "text-anchor=\"middle\"", chart_.x.label);
    svg += Text(panel_.left + 13, middle,
                fmt::format("text-anchor=\"middle\" transform=\"rotate(-90 {:.1f} {:.1f})\"",
                            panel_.left + 13, middle)
                    .c_str(),
                chart_.y.label);
    return svg;
  }

  std::string DrawSeries(const Series& series) const {
    std::string path, dots;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!std::isfinite(series.x[i]) || !std::isfinite(series.y[i])) continue;
      const double x = x_.Px(series.x[i]), y = y_.Px(series.y[i]);
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', x, y);
      dots += Dot(x, y, ColourOf(series));
    }
    if (series.mark == Mark::kBars) return Bars(series);
    if (series.mark == Mark::kDots) return dots;
    const std::string line = Stroke(path, ColourOf(series), series.mark == Mark::kDashed);
    return series.mark == Mark::kLineDots ? line + dots : line;
  }

  std::string Bars(const Series& series) const {
    const double step = series.x.size() > 1 ? series.x[1] - series.x[0] : 1;
    std::string svg;
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      const double left = x_.Px(series.x[i] - 0.48 * step), right = x_.Px(series.x[i] + 0.48 * step);
      svg +=
          fmt::format("<path d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}V{:.1f}z\" fill=\"{}\" fill-opacity=\"0.6\"/>\n",
                      left, y_.start_px, y_.Px(series.y[i]), right, y_.start_px, ColourOf(series));
    }
    return svg;
  }

  std::string DrawGoal(const GoalLine& goal) const {
    constexpr const char* kStyle = "stroke=\"#1f2933\" stroke-width=\"1.4\" stroke-dasharray=\"2 3\"";
    if (goal.is_x) {
      return Line(x_.Px(goal.at), y_.start_px, x_.Px(goal.at), y_.end_px, kStyle) +
             Text(x_.Px(goal.at) + 5, y_.start_px - 8, "", goal.label);
    }
    return Line(x_.start_px, y_.Px(goal.at), x_.end_px, y_.Px(goal.at), kStyle) +
           Text(x_.end_px - 4, y_.Px(goal.at) - 5, "text-anchor=\"end\"", goal.label);
  }

  const Chart& chart_;
  const Panel& panel_;
  int legend_rows_ = 0;
  std::string legend_;
  Axis x_{}, y_{};
};

}  // namespace

std::string DrawChart(const Chart& chart, const Panel& panel) { return ChartPainter(chart, panel).Draw(); }

std::string DrawPicture(const Picture& picture, const Panel& panel) {
  const double width = panel.width - 24;
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(picture.png.data()), picture.png.size());
  return Text(panel.left + 12, panel.top + 20, "font-size=\"15\" font-weight=\"600\"", picture.title) +
         fmt::format(
             "<image x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
             "href=\"data:image/png;base64,{}\"/>\n",
             panel.left + 12, panel.top + 34, width, width * picture.aspect, Base64(bytes)) +
         Text(panel.left + 12, panel.top + 54 + width * picture.aspect, "", picture.caption);
}

std::string PictureMark(const std::string& name) {
  return fmt::format("<!-- picture of: forgescan experiment {} -->", name);
}

std::string SvgFile(const std::string& name, double width, double height, const std::string& body) {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"Segoe UI,Helvetica Neue,Arial,DejaVu Sans,sans-serif\" font-size=\"13\" "
      "fill=\"#1f2933\">\n{2}\n<path d=\"M0 0h{0}v{1}h-{0}z\" fill=\"#fff\"/>\n{3}</svg>\n",
      width, height, PictureMark(name), body);
}

}  // namespace forgescan
