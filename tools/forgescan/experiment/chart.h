// Pictures of experiments: charts with axes, units, goal lines and legend, as SVG on a white ground.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace forgescan {

enum class Mark { kLine, kDashed, kDots, kBars, kLineDots };

// Shape: x and y of equal length. What lies outside the axes is cut at their border.
struct Series {
  std::string label;  // empty: not in the legend
  Mark mark = Mark::kLine;
  std::vector<double> x, y;
  int colour = 0;  // 0 to 5
};

struct AxisSpec {
  std::string label;  // with unit
  bool is_log = false;
  std::optional<double> low = {}, high = {};  // else from the series and goals
};

// A line at a value of y across the chart (is_x: of x, upright), with its words at the end.
struct GoalLine {
  double at = 0;
  std::string label;
  bool is_x = false;
};

struct Chart {
  std::string title;
  AxisSpec x = {}, y = {};
  std::vector<Series> series = {};
  std::vector<GoalLine> goals = {};
};

// Units: px.
struct Panel {
  double left = 0, top = 0, width = 900, height = 420;
};

std::string DrawChart(const Chart& chart, const Panel& panel);

// A picture that is data: PNG bytes, drawn into the panel below its title, with a line of text below.
struct Picture {
  std::string title, caption;
  std::string png;
  double aspect = 1;  // height / width
};
std::string DrawPicture(const Picture& picture, const Panel& panel);

// The whole file; its mark says which experiment owns it.
std::string SvgFile(const std::string& name, double width, double height, const std::string& body);
std::string PictureMark(const std::string& name);

}  // namespace forgescan
