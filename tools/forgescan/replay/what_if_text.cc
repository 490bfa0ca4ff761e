#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "services/report/report_style.h"
#include "services/report/report_text.h"
#include "services/report/verdict_rule.h"
#include "tools/forgescan/replay/what_if.h"

namespace forgescan {
namespace {

constexpr const char* kClasses[] = {"not-inspected", "ok", "not-ok", "not-decidable", "not-inspected"};

std::string_view NameOf(std::int8_t number) {
  const Verdict verdict = VerdictFromNumber(number);
  return verdict == Verdict::kUnknown ? "none" : VerdictText(verdict);
}

std::string Chip(std::int8_t verdict) {
  return fmt::format("<span class=\"chip {}\">{}</span>",
                     kClasses[static_cast<std::size_t>(VerdictFromNumber(verdict))], NameOf(verdict));
}

std::string ChipPair(std::int8_t recorded, std::int8_t now) {
  return recorded == now ? Chip(now) : Chip(recorded) + " &rarr; " + Chip(now);
}

std::size_t Flips(const std::vector<PartChange>& parts) {
  return static_cast<std::size_t>(
      std::count_if(parts.begin(), parts.end(), [](const auto& part) { return part.Flipped(); }));
}

// What becomes of a dimension over all parts.
struct Summary {
  std::string name;
  double change_mm = 0.0;    // the largest
  int part = 0;              // of it
  int lost = 0, gained = 0;  // sizes that are not determined any more, or only now
  int flips = 0;
};

std::vector<Summary> Summaries(const std::vector<PartChange>& parts) {
  std::vector<Summary> all;
  for (const PartChange& part : parts) {
    for (const DimensionChange& d : part.dimensions) {
      auto found =
          std::find_if(all.begin(), all.end(), [&d](const auto& other) { return other.name == d.name; });
      if (found == all.end()) {
        found = all.insert(all.end(), {.name = d.name});
      }
      found->flips += d.Flipped() ? 1 : 0;
      const bool was = std::isfinite(d.recorded_mm), is = std::isfinite(d.now_mm);
      found->lost += was && !is ? 1 : 0;
      found->gained += is && !was ? 1 : 0;
      const double change_mm = d.now_mm - d.recorded_mm;
      if (std::isfinite(change_mm) && std::abs(change_mm) > std::abs(found->change_mm)) {
        found->change_mm = change_mm;
        found->part = part.part;
      }
    }
  }
  return all;
}

std::string SummaryText(const Summary& summary) {
  std::vector<std::string> changes;
  if (summary.change_mm != 0.0) {
    changes.push_back(fmt::format("largest change {:+.4f} mm (part {})", summary.change_mm, summary.part));
  }
  if (summary.lost > 0) {
    changes.push_back(fmt::format("{} sizes are not determined any more", summary.lost));
  }
  if (summary.gained > 0) {
    changes.push_back(fmt::format("{} sizes are determined only now", summary.gained));
  }
  if (changes.empty()) {
    changes.push_back("every size as recorded");
  }
  return fmt::format("{}, {} verdicts change", fmt::join(changes, ", "), summary.flips);
}

std::string DimensionRow(const PartChange& part, const DimensionChange& d, bool first) {
  const std::string number =
      first ? fmt::format("<td class=\"t strong\" rowspan=\"{}\">{}<br>{}</td>", part.dimensions.size(),
                          part.part, ChipPair(part.recorded_verdict, part.now_verdict))
            : std::string();
  return fmt::format(
      "<tr>{}<td class=\"t\">{}</td><td>{} &hellip; {}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
      "<td>{}</td><td class=\"t\">{}</td></tr>\n",
      number, EscapeHtml(d.name), NumberText(d.lower_mm, 3), NumberText(d.upper_mm, 3),
      NumberText(d.recorded_mm, 3), NumberText(d.now_mm, 3), SignedText(d.now_mm - d.recorded_mm, 4),
      NumberText(d.recorded_u_mm, 3), NumberText(d.now_u_mm, 3), ChipPair(d.recorded_verdict, d.now_verdict));
}

std::string PartRows(const PartChange& part) {
  std::string rows;
  for (std::size_t i = 0; i < part.dimensions.size(); ++i) {
    rows += DimensionRow(part, part.dimensions[i], i == 0);
  }
  if (part.Flipped()) {
    const std::string reason = part.now_reason.empty() ? part.recorded_reason : part.now_reason;
    rows += fmt::format("<tr class=\"remark\"><td class=\"t\" colspan=\"9\">Part {}: {}</td></tr>\n",
                        part.part, EscapeHtml(reason));
  }
  return rows;
}

std::string List(const std::vector<std::string>& lines) {
  std::string items;
  for (const std::string& line : lines) {
    items += "<li>" + EscapeHtml(line) + "</li>";
  }
  return "<ul>" + items + "</ul>";
}

std::string Section(const char* title, const std::string& content) {
  return fmt::format("<section><h2>{}</h2>\n{}</section>\n", title, content);
}

}  // namespace

std::string WhatIfText(const std::vector<PartChange>& parts) {
  std::string text;
  for (const PartChange& part : parts) {
    if (part.Flipped()) {
      text += fmt::format("part {}: {} -> {}{}\n", part.part, NameOf(part.recorded_verdict),
                          NameOf(part.now_verdict),
                          part.now_reason.empty() ? std::string() : " (" + part.now_reason + ")");
    }
    for (const DimensionChange& d : part.dimensions) {
      if (d.Flipped()) {
        text +=
            fmt::format("part {}: {}: {} -> {}, {} -> {} mm\n", part.part, d.name, NameOf(d.recorded_verdict),
                        NameOf(d.now_verdict), NumberText(d.recorded_mm, 4), NumberText(d.now_mm, 4));
      }
    }
  }
  text += fmt::format("{} of {} verdicts change\n", Flips(parts), parts.size());
  for (const Summary& summary : Summaries(parts)) {
    text += fmt::format("  {}: {}\n", summary.name, SummaryText(summary));
  }
  return text;
}

std::string WhatIfHtml(const WhatIfPage& page, const std::vector<PartChange>& parts) {
  std::string rows =
      "<tr><th class=\"t\">Part</th><th class=\"t\">Dimension</th><th>Limits (mm)</th><th>Recorded (mm)</th>"
      "<th>Now (mm)</th><th>Change (mm)</th><th>U recorded</th><th>U now</th><th "
      "class=\"t\">Verdict</th></tr>\n";
  for (const PartChange& part : parts) {
    rows += PartRows(part);
  }
  const std::string flips = fmt::format("{} of {}", Flips(parts), parts.size());
  const std::string body =
      fmt::format(
          "<header><div><div class=\"over\">What if</div><h1>{} verdicts change</h1>"
          "<div class=\"sub\">Station {}</div></div></header>\n",
          flips, EscapeHtml(page.station)) +
      Section("Changed settings", page.changes.empty() ? "<p class=\"none\">None.</p>" : List(page.changes)) +
      (page.remarks.empty()
           ? std::string()
           : Section("The recordings are not whole, or not as they were made", List(page.remarks))) +
      Section("Parts", "<table>" + rows + "</table>") + Section("Recordings", List(page.recordings));
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>What if: {} verdicts "
      "change</title><style>{}</style></head>\n<body><main>\n{}</main></body></html>\n",
      flips, kReportStyle, body);
}

}  // namespace forgescan
