// report.json has exactly its fields, null for what is not known; the page shows the same numbers and escapes
// text.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/report/report_html.h"
#include "services/report/report_json.h"
#include "services/report/report_text.h"
#include "tests/services/report/sample_report.h"

namespace forgescan {
namespace {

using nlohmann::json;

std::vector<std::string> Keys(const json& object) {
  std::vector<std::string> keys;
  for (const auto& item : object.items()) {
    keys.push_back(item.key());  // sorted
  }
  return keys;
}

std::string InCell(const std::string& text) { return fmt::format(">{}<", text); }

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST(ReportPages, TellWhatAnUncertaintyIsMadeOf) {
  PartReport report = SampleReport(12);
  EXPECT_EQ(ReportHtml(report).find("<h2>Uncertainty</h2>"), std::string::npos);
  report.dimensions[0].uncertainty_terms = {{"scatter <of> the points", 0.0123}, {"robot", 0.0045}};
  const json dimension = json::parse(ReportJson(report))["dimensions"][0];
  EXPECT_EQ(dimension["uncertainty_contributions"][1]["name"], "robot");
  EXPECT_EQ(dimension["uncertainty_contributions"][1]["standard_mm"], 0.0045);
  const std::string page = ReportHtml(report);
  EXPECT_NE(page.find("<h2>Uncertainty</h2>"), std::string::npos);
  EXPECT_NE(page.find("scatter &lt;of&gt; the points"), std::string::npos);
  EXPECT_NE(page.find("0.0123"), std::string::npos);
}

TEST(ReportJson, HasExactlyItsFields) {
  const json report = json::parse(ReportJson(SampleReport(12)));
  using List = std::vector<std::string>;
  EXPECT_EQ(Keys(report), (List{"arrived_utime", "config_hash", "counters", "dimensions", "last_view_utime",
                                "part", "reason", "reference_degc", "registration", "software_version",
                                "station", "timing_s", "verdict", "verdict_time", "verdict_utime", "views"}));
  EXPECT_EQ(Keys(report["dimensions"][0]),
            (List{"definition", "deviation_mm", "lower_mm", "measured_mm", "name", "nominal_mm", "points",
                  "reason", "rejected_share", "temperature_degc", "uncertainty_contributions",
                  "uncertainty_mm", "upper_mm", "verdict"}));
  EXPECT_EQ(Keys(report["registration"]),
            (List{"foreign_share", "inlier_share", "iterations", "model_from_array", "reason", "rms_mm",
                  "shift_mm", "status", "turn_rad", "weakest_eigenvalue"}));
  EXPECT_EQ(Keys(report["views"][0]),
            (List{"captured_utime", "consistency_rms_rad", "modulation_median_dn", "points", "reason",
                  "scale", "status", "temperature_degc", "view"}));
  EXPECT_EQ(Keys(report["timing_s"]),
            (List{"fusion", "last_frame_to_verdict", "reconstruction", "registration", "report", "scan"}));
  EXPECT_EQ(Keys(report["counters"]),
            (List{"frames_expected", "frames_lost", "frames_used", "messages_missing", "restarts"}));
}

TEST(ReportJson, TellsTheNumbersAndNullForWhatIsNotKnown) {
  const json report = json::parse(ReportJson(SampleReport(12)));
  EXPECT_EQ(report["part"], 112);
  EXPECT_EQ(report["verdict"], "NOT_OK");
  EXPECT_EQ(report["verdict_time"], "2023-11-14 22:13:49 UTC");
  EXPECT_EQ(report["dimensions"][0]["measured_mm"], 1888.0 - 0.8123) << "not rounded";
  EXPECT_EQ(report["dimensions"][0]["verdict"], "NOT_DECIDABLE");
  EXPECT_TRUE(report["dimensions"][4]["measured_mm"].is_null());
  EXPECT_TRUE(report["views"][6]["captured_utime"].is_null());
  EXPECT_EQ(report["registration"]["model_from_array"].size(), 16u);
  EXPECT_EQ(report["registration"]["model_from_array"][3], 3.25);
  const json empty = json::parse(ReportJson(PartReport{}));
  EXPECT_TRUE(empty["registration"]["model_from_array"].is_null());
  EXPECT_TRUE(empty["timing_s"]["scan"].is_null());
  EXPECT_TRUE(empty["counters"]["frames_lost"].is_null());
}

TEST(ReportJson, SurvivesTextThatIsNotUtf8) {
  PartReport report;
  report.verdict.reason = "\xff\xfe";
  EXPECT_FALSE(json::parse(ReportJson(report), nullptr, false).is_discarded());
}

TEST(ReportHtml, ShowsTheNumbersOfTheJson) {
  const PartReport report = SampleReport(12);
  const json same = json::parse(ReportJson(report));
  const std::string page = ReportHtml(report);
  for (const json& dimension : same["dimensions"]) {
    EXPECT_NE(page.find(dimension["name"].get<std::string>()), std::string::npos);
    if (!dimension["measured_mm"].is_null()) {
      EXPECT_NE(page.find(InCell(NumberText(dimension["measured_mm"], 3))), std::string::npos);
      EXPECT_NE(page.find(InCell(SignedText(dimension["deviation_mm"], 3))), std::string::npos);
      EXPECT_NE(page.find(InCell(NumberText(dimension["uncertainty_mm"], 3))), std::string::npos);
    }
  }
  EXPECT_NE(page.find("Not OK"), std::string::npos);
  EXPECT_NE(page.find(report.dimensions[4].reason), std::string::npos);
}

TEST(ReportHtml, EscapesAllTextAndNeedsNothingFromOutside) {
  PartReport report = SampleReport(12);
  const std::string nasty = "<script>alert('x')</script>&\"";
  report.dimensions[0].name = report.dimensions[0].reason = report.views[0].reason = nasty;
  report.registration.reason = report.registration.status = report.verdict.reason = report.software_version =
      nasty;
  report.views[1].status = report.trends[0].name = report.station = report.config_hash = nasty;
  const std::string page = ReportHtml(report);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("alert('x')"), std::string::npos);
  EXPECT_NE(page.find("&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;&quot;"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_EQ(page.find("src=\"/"), std::string::npos);
}

TEST(ReportHtml, DrawsATrendForEachDimensionAndMarksThePart) {
  const std::string page = ReportHtml(SampleReport(20));
  EXPECT_EQ(Count(page, "<svg class=\"chart\""), 3u);
  EXPECT_EQ(Count(page, "class=\"ring\""), 3u);
  EXPECT_EQ(Count(page, "class=\"trend\""), 1u) << "one of the three is significant";
  EXPECT_NE(page.find("to the lower limit (95\u00a0%)"), std::string::npos);
  EXPECT_NE(page.find("No significant trend over 19 parts"), std::string::npos);
  EXPECT_NE(page.find("no trend yet"), std::string::npos);
}

TEST(ReportHtml, APartWithoutAnythingIsAPageToo) {
  PartReport report;
  report.verdict = {Verdict::kNotInspected, "Nothing came of this part."};
  const std::string page = ReportHtml(report);
  EXPECT_NE(page.find("Not inspected"), std::string::npos);
  EXPECT_EQ(page.find("nan"), std::string::npos);
}

TEST(IndexHtml, LinksTheParts) {
  const std::vector<PartRecord> parts = {
      {7, 1'700'000'000'000'000, Verdict::kOk, "", "20231114T221320Z-part-000007", {}},
      {6, 1'699'999'955'000'000, Verdict::kNotOk, "too <long>", "folder-6", {}}};
  const std::string page = IndexHtml("A & B", parts);
  EXPECT_NE(page.find("href=\"20231114T221320Z-part-000007/report.html\""), std::string::npos);
  EXPECT_NE(page.find("too &lt;long&gt;"), std::string::npos);
  EXPECT_NE(page.find("A &amp; B"), std::string::npos);
}

TEST(ReportText, NumbersAndTimes) {
  EXPECT_EQ(NumberText(-0.00004, 3), "0.000");
  EXPECT_EQ(SignedText(0.0712, 3), "+0.071");
  EXPECT_EQ(SignedText(-1.5, 1), "\u22121.5");
  EXPECT_EQ(NumberText(kNotKnown, 3), "\u2013");
  EXPECT_EQ(CountText(1234567), "1\u202f234\u202f567");
  EXPECT_EQ(UtcText(0), "");
  EXPECT_EQ(UtcFileText(1'700'000'000'000'000), "20231114T221320Z");
}

}  // namespace
}  // namespace forgescan
