#include "tools/forgescan/station/run_outcome.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Problems = std::vector<std::string>;

// A part that could not be inspected is no result, however well that is reported.
void JudgeRun(const std::vector<fsmsg::verdict_t>& verdicts, int parts, Problems& problems) {
  if (static_cast<int>(verdicts.size()) != parts) {
    problems.push_back(fmt::format("{} verdicts came for {} parts", verdicts.size(), parts));
  }
  for (const fsmsg::verdict_t& verdict : verdicts) {
    if (verdict.verdict == fsmsg::verdict_t::VERDICT_NOT_INSPECTED ||
        verdict.verdict == fsmsg::verdict_t::VERDICT_UNKNOWN) {
      problems.push_back(fmt::format("part {} was not inspected: {}", verdict.part, verdict.reason));
    }
  }
}

void ShowReport(const fs::path& run, const fs::path& folder, int part, Problems& problems) {
  if (!fs::exists(folder / "report.html") || !fs::exists(folder / "report.json")) {
    problems.push_back(
        fmt::format("part {} has no report in {}; {} has the logs", part, folder.string(), run.string()));
    return;
  }
  std::printf("report %s\n", folder.c_str());
  const fs::path truth = run / "truth" / fmt::format("part_{:06}.json", part);
  std::error_code problem;
  fs::copy_file(truth, folder / "truth.json", fs::copy_options::overwrite_existing, problem);
  if (problem) {
    problems.push_back(
        fmt::format("{} cannot be copied to {}: {}", truth.string(), folder.string(), problem.message()));
  }
}

}  // namespace

bool PagesAreWritten(const fs::path& results, const std::vector<fsmsg::verdict_t>& verdicts) {
  return std::ranges::all_of(verdicts, [&results](const fsmsg::verdict_t& verdict) {
    return fs::exists(results / verdict.report_folder / "report.html");
  });
}

Status ShowOutcome(const fs::path& run, const fs::path& results,
                   const std::vector<fsmsg::verdict_t>& verdicts, int parts) {
  Problems problems;
  JudgeRun(verdicts, parts, problems);
  for (const fsmsg::verdict_t& verdict : verdicts) {
    ShowReport(run, results / verdict.report_folder, verdict.part, problems);
  }
  if (!problems.empty()) {
    return Fail(ErrorCode::kUntrusted, "{}", fmt::join(problems, "; "));
  }
  return {};
}

}  // namespace forgescan
