#include "services/report/report_html.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "services/common/base64.h"
#include "services/report/report_charts.h"
#include "services/report/report_style.h"
#include "services/report/report_text.h"

namespace forgescan {
namespace {

std::string Page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>{}</title><style>{}</style></"
      "head>\n<body><main>\n{}"
      "</main></body></html>\n",
      EscapeHtml(title), kReportStyle, body);
}

std::string Section(const char* title, const std::string& content) {
  return fmt::format("<section><h2>{}</h2>\n{}</section>\n", title, content);
}

std::string Tile(const char* name, const std::string& value) {
  return fmt::format("<div><span>{}</span><b>{}</b></div>", name, value);
}

std::string Cell(const std::string& text) { return "<td>" + text + "</td>"; }
std::string TextCell(const std::string& text) { return "<td class=\"t\">" + text + "</td>"; }

std::string WithUnit(double value, int decimals, const char* unit) {
  return std::isfinite(value) ? fmt::format("{} {}", NumberText(value, decimals), unit)
                              : NumberText(value, decimals);
}

std::string Percent(double share) { return WithUnit(100.0 * share, 1, "%"); }

std::string Header(const PartReport& report) {
  const Verdict verdict = report.verdict.verdict;
  const std::int64_t shown_utime = report.last_view_utime > 0 ? report.last_view_utime : report.verdict_utime;
  return fmt::format(
      "<header><div><div class=\"over\">In-line 3D inspection report</div><h1>Part {}</h1>"
      "<div class=\"sub\">Station {} &middot; {}</div></div>"
      "<div class=\"verdict\"><span class=\"badge {}\">{}</span><p>{}</p></div></header>\n",
      report.part, EscapeHtml(report.station), UtcText(shown_utime), VerdictClass(verdict),
      VerdictLabel(verdict), EscapeHtml(report.verdict.reason));
}

std::string Overview(const PartReport& report) {
  const auto used =
      std::count_if(report.views.begin(), report.views.end(), [](const auto& v) { return v.status == "OK"; });
  const auto measured = std::count_if(report.dimensions.begin(), report.dimensions.end(),
                                      [](const auto& d) { return std::isfinite(d.measured_mm); });
  std::string tiles =
      Tile("Dimensions measured", fmt::format("{} of {}", measured, report.dimensions.size()));
  tiles += Tile("Sizes hold at", WithUnit(report.reference_degc, 1, "&deg;C"));
  tiles += Tile("Views used", fmt::format("{} of {}", used, report.views.size()));
  tiles += Tile("Frames lost", fmt::format("{} of {}", CountText(report.counters.frames_lost),
                                           CountText(report.counters.frames_expected)));
  tiles += Tile("Alignment rms", WithUnit(report.registration.rms_mm, 3, "mm"));
  tiles += Tile("Last frame to verdict", WithUnit(report.timing_s.last_frame_to_verdict, 2, "s"));
  return "<section><div class=\"tiles\">" + tiles + "</div></section>\n";
}

std::string DimensionRow(const JudgedDimension& from) {
  const std::string remark =
      from.reason.empty() ? ""
                          : fmt::format("<tr class=\"remark\"><td class=\"t\" colspan=\"10\">{}</td></tr>\n",
                                        EscapeHtml(from.reason));
  const char* kind = from.reason.empty() ? "<tr>" : "<tr class=\"remarked\">";
  return kind + TextCell(EscapeHtml(from.name)) + Cell(NumberText(from.nominal_mm, 3)) +
         fmt::format("<td class=\"w\">{} &hellip; {}</td>", NumberText(from.lower_mm, 3),
                     NumberText(from.upper_mm, 3)) +
         "<td class=\"strong\">" + NumberText(from.measured_mm, 3) + "</td>" +
         Cell(SignedText(from.deviation_mm, 3)) + Cell(NumberText(from.uncertainty_mm, 3)) +
         "<td class=\"c\">" + LimitsChart(from) + "</td>" + Cell(CountText(from.points)) +
         Cell(Percent(from.rejected_share)) +
         fmt::format("<td class=\"c\"><span class=\"chip {}\">{}</span></td></tr>\n",
                     VerdictClass(from.verdict), VerdictLabel(from.verdict)) +
         remark;
}

std::string Dimensions(const PartReport& report) {
  std::string table =
      "<table><thead><tr><th "
      "class=\"t\">Dimension</th><th>Nominal<br>mm</th><th>Limits<br>mm</th><th>Measured<br>mm</th>"
      "<th>Deviation<br>mm</th><th>U (k&nbsp;=&nbsp;2)<br>mm</th><th class=\"c\">Place within "
      "limits</th><th>Points</th>"
      "<th>Rejected</th><th class=\"c\">Verdict</th></tr></thead><tbody>\n";
  for (const JudgedDimension& dimension : report.dimensions) {
    table += DimensionRow(dimension);
  }
  return Section("Dimensions", table + "</tbody></table>\n");
}

// One row a contribution, one column a dimension whose uncertainty was computed.
std::string Uncertainties(const PartReport& report) {
  std::vector<const JudgedDimension*> columns;
  for (const JudgedDimension& dimension : report.dimensions) {
    if (!dimension.uncertainty_terms.empty()) columns.push_back(&dimension);
  }
  if (columns.empty()) return "";
  std::string table = "<table><thead><tr><th class=\"t\">Standard uncertainty, mm</th>";
  for (const JudgedDimension* column : columns) table += "<th>" + EscapeHtml(column->name) + "</th>";
  table += "</tr></thead><tbody>\n";
  for (std::size_t i = 0; i < columns.front()->uncertainty_terms.size(); ++i) {
    table += "<tr>" + TextCell(EscapeHtml(columns.front()->uncertainty_terms[i].name));
    for (const JudgedDimension* column : columns) {
      table += Cell(NumberText(column->uncertainty_terms[i].standard_mm, 4));
    }
    table += "</tr>\n";
  }
  table += "<tr>" + TextCell("U (k&nbsp;=&nbsp;2)");
  for (const JudgedDimension* column : columns) table += Cell(NumberText(column->uncertainty_mm, 4));
  return Section("Uncertainty", table + "</tr></tbody></table>\n");
}

std::string Picture(const PartReport& report) {
  if (report.deviation_picture.empty()) {
    return Section("Deviation from the design model",
                   "<p class=\"none\">No picture: the part's points did not reach the report.</p>\n");
  }
  return Section(
      "Deviation from the design model",
      fmt::format("<img class=\"picture\" alt=\"The part from four sides, coloured by its deviation\" "
                  "src=\"data:image/png;base64,{}\">\n",
                  Base64(report.deviation_picture)));
}

std::string Trends(const PartReport& report) {
  if (report.trends.empty()) {
    return "";
  }
  std::string charts;
  for (const ReportedTrend& trend : report.trends) {
    charts += fmt::format("<figure><figcaption>{}<small>{}</small></figcaption>{}</figure>\n",
                          EscapeHtml(trend.name), TrendSentence(trend), TrendChart(trend));
  }
  return Section("Last parts, mm", "<div class=\"charts\">" + charts + "</div>\n");
}

std::string ViewRow(const ReportedView& from) {
  const std::string remark = from.reason.empty() ? "" : "<small>" + EscapeHtml(from.reason) + "</small>";
  const char* kind = from.status == "OK" ? "ok" : "not-inspected";
  return "<tr>" + TextCell(fmt::format("{}{}", from.view, remark)) +
         fmt::format("<td class=\"c\"><span class=\"chip {}\">{}</span></td>", kind,
                     EscapeHtml(from.status)) +
         Cell(from.captured_utime > 0 ? UtcText(from.captured_utime).substr(11, 8)
                                      : NumberText(kNotKnown, 0)) +
         Cell(NumberText(from.temperature_degc, 1)) + Cell(NumberText(from.scale, 6)) +
         Cell(CountText(from.points)) + Cell(NumberText(from.modulation_median_dn, 1)) +
         Cell(NumberText(from.consistency_rms_rad, 3)) + "</tr>\n";
}

std::string Views(const PartReport& report) {
  if (report.views.empty()) {
    return Section("Views", "<p class=\"none\">The result of the fusion did not reach the report.</p>\n");
  }
  std::string table =
      "<table><thead><tr><th class=\"t\">View</th><th "
      "class=\"c\">Status</th><th>Taken<br>UTC</th><th>Part<br>&deg;C</th>"
      "<th>Scale to<br>reference</th><th>Points</th><th>Fringe contrast,<br>median, grey values</th>"
      "<th>Phase disagreement,<br>rms, rad</th></tr></thead><tbody>\n";
  for (const ReportedView& view : report.views) {
    table += ViewRow(view);
  }
  return Section("Views", table + "</tbody></table>\n");
}

std::string Figure(const char* name, const std::string& value) {
  return "<tr><td class=\"t\">" + std::string(name) + "</td>" + Cell(value) + "</tr>";
}

std::string Registration(const ReportedRegistration& from) {
  std::string rows = Figure("Status", EscapeHtml(from.status)) +
                     Figure("Iterations", CountText(from.iterations)) +
                     Figure("Residual, rms", WithUnit(from.rms_mm, 4, "mm")) +
                     Figure("Inliers", Percent(from.inlier_share)) +
                     Figure("Foreign points removed", Percent(from.foreign_share)) +
                     Figure("Shift against the expected place", WithUnit(from.shift_mm, 3, "mm")) +
                     Figure("Turn against the expected place", WithUnit(1000.0 * from.turn_rad, 3, "mrad")) +
                     Figure("Weakest direction", NumberText(from.weakest_eigenvalue, 4));
  const std::string remark = from.reason.empty() ? "" : "<p>" + EscapeHtml(from.reason) + "</p>";
  return Section("Alignment to the design model", "<table><tbody>" + rows + "</tbody></table>" + remark);
}

std::string TimingAndCounters(const PartReport& report) {
  const ReportedTiming& took = report.timing_s;
  const ReportedCounters& counted = report.counters;
  std::string rows = Figure("Scan", WithUnit(took.scan, 2, "s")) +
                     Figure("Reconstruction, all views", WithUnit(took.reconstruction, 3, "s")) +
                     Figure("Fusion", WithUnit(took.fusion, 3, "s")) +
                     Figure("Alignment", WithUnit(took.registration, 3, "s")) +
                     Figure("Measurement and verdict", WithUnit(took.report, 3, "s")) +
                     Figure("Frames used", fmt::format("{} of {}", CountText(counted.frames_used),
                                                       CountText(counted.frames_expected))) +
                     Figure("Messages given up meanwhile", CountText(counted.messages_missing)) +
                     Figure("Restarts of services meanwhile", CountText(counted.restarts));
  return Section("Timing and transport", "<table><tbody>" + rows + "</tbody></table>");
}

std::string Footer(const PartReport& report) {
  return fmt::format(
      "<footer><p><b>Decision rule.</b> U is the expanded uncertainty, k = 2 (about 95 %). OK: the measured "
      "size lies within "
      "the limits by at least U. Not OK: it lies outside by more than U. Not decidable: between. Not "
      "inspected: there is no "
      "measured value. After ISO 14253-1.</p><p><b>Conventions.</b> Sizes, limits and deviations are those "
      "of the hot part at "
      "the temperature stated. Lengths: between the least-squares planes of two faces, along the datum axis. "
      "Widths: mean "
      "distance of one face from the least-squares plane of the other. Diameters: least-squares cylinder "
      "(ISO 14405-1 GG). "
      "Deviation = measured &minus; nominal. Parts to the limit: until the 95 % prediction meets the limit "
      "less U.</p>"
      "<p>forgescan {} &middot; configuration {} &middot; verdict at {} &middot; part in place at "
      "{}</p></footer>\n",
      EscapeHtml(report.software_version), EscapeHtml(report.config_hash), UtcText(report.verdict_utime),
      report.arrived_utime > 0 ? UtcText(report.arrived_utime) : "an unknown time");
}

std::string IndexRow(const PartRecord& part) {
  return fmt::format(
      "<tr><td class=\"t\"><a href=\"{}/report.html\">Part {}</a></td><td class=\"t\">{}</td>"
      "<td class=\"c\"><span class=\"chip {}\">{}</span></td><td class=\"t\">{}</td></tr>\n",
      EscapeHtml(part.report_folder), part.part, UtcText(part.utime), VerdictClass(part.verdict),
      VerdictLabel(part.verdict), EscapeHtml(part.reason));
}

}  // namespace

std::string ReportHtml(const PartReport& report) {
  return Page(fmt::format("Part {}: {}", report.part, VerdictLabel(report.verdict.verdict)),
              Header(report) + Overview(report) + Dimensions(report) + Uncertainties(report) +
                  Picture(report) + Trends(report) + Views(report) + "<div class=\"pair\">" +
                  Registration(report.registration) + TimingAndCounters(report) + "</div>\n" +
                  Footer(report));
}

std::string IndexHtml(const std::string& station, std::span<const PartRecord> parts) {
  std::string rows;
  for (const PartRecord& part : parts) {
    rows += IndexRow(part);
  }
  return Page(
      "Inspected parts: " + station,
      fmt::format("<header><div><div class=\"over\">In-line 3D inspection</div><h1>Inspected parts</h1>"
                  "<div class=\"sub\">Station {}, last {} parts</div></div></header>\n",
                  EscapeHtml(station), parts.size()) +
          "<section><table><thead><tr><th class=\"t\">Part</th><th class=\"t\">Last view</th><th "
          "class=\"c\">Verdict"
          "</th><th class=\"t\">Reason</th></tr></thead><tbody>\n" +
          rows + "</tbody></table></section>\n");
}

}  // namespace forgescan
