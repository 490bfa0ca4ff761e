#include "tools/forgescan/experiment/experiment_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/common/input_file.h"
#include "services/common/output_file.h"
#include "tools/forgescan/experiment/chart.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPageMark = "<!-- page of: forgescan experiment -->\n";
constexpr const char* kHead =
    "# Experiments\n"
    "The paper's experiments on the virtual station, and tests of the theory, each with the truth beside it. "
    "Every section is\nwritten by the command that stands in it: the same command gives the same bytes. "
    "Lengths "
    "are mm, angles rad, grey values DN of\nan 8-bit image.\n";

std::string Begin(const std::string& name) { return fmt::format("<!-- begin: {} -->\n", name); }
std::string End(const std::string& name) { return fmt::format("<!-- end: {} -->\n", name); }

std::string NumberText(double value) { return fmt::format("{:.4g}", value); }

Table GoalTable(const std::vector<Goal>& goals) {
  Table table{{"goal", "limit", "found", "", ""}, {}};
  for (const Goal& goal : goals) {
    table.rows.push_back({goal.what,
                          fmt::format("{} {}", goal.is_floor ? ">=" : "<=", NumberText(goal.limit)),
                          NumberText(goal.value), goal.unit, goal.IsMet() ? "met" : "MISSED"});
  }
  return table;
}

std::string MarkdownRow(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += fmt::format(" {} |", cell);
  return text + "\n";
}

std::string Markdown(const Table& table) {
  std::string text = fmt::format("\n{}", MarkdownRow(table.header));
  text += MarkdownRow(std::vector<std::string>(table.header.size(), "---"));
  for (const auto& row : table.rows) text += MarkdownRow(row);
  return text;
}

// Characters, not bytes: the tables hold a few beyond ASCII.
std::size_t Length(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string Aligned(const Table& table) {
  std::vector<std::size_t> width(table.header.size(), 0);
  std::vector<std::vector<std::string>> rows = {table.header};
  rows.insert(rows.end(), table.rows.begin(), table.rows.end());
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], Length(row[i]));
  }
  std::string text = "\n";
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string space(width[i] - Length(row[i]) + 2, ' ');
      text += i == 0 ? row[i] + space : space + row[i];
    }
    text += "\n";
  }
  return text;
}

std::string Command(const Experiment& experiment, const ExperimentOptions& options) {
  const ExperimentOptions standard;
  std::string text = fmt::format("forgescan experiment {} --seed {}", experiment.name, options.seed);
  if (options.runs != 0) text += fmt::format(" --runs {}", options.runs);
  if (experiment.uses_cell && options.scale_divisor != standard.scale_divisor) {
    text += fmt::format(" --scale-divisor {}", options.scale_divisor);
  }
  return text;
}

// An empty text for a file that does not exist.
Result<std::string> TextOf(const fs::path& path) {
  if (!fs::exists(path)) return std::string();
  return ReadInputFile(path);
}

fs::path PagePath(const fs::path& folder) { return folder / "experiments.md"; }
fs::path PicturePath(const fs::path& folder, const std::string& name) {
  return folder / "experiments" / (name + ".svg");
}

Status CheckPage(const std::string& page) {
  if (page.empty() || page.starts_with(kPageMark)) return {};
  return Fail(ErrorCode::kInvalidArgument,
              "experiments.md was not written by forgescan experiment: it is left as it is");
}

}  // namespace

std::string SectionText(const Experiment& experiment, const ExperimentOptions& options,
                        const ExperimentReport& report) {
  std::string text = fmt::format("## {}\n{}\n", experiment.title, report.question);
  text += fmt::format("\n    {}\n", Command(experiment, options));
  for (const Table& table : report.tables) text += Markdown(table);
  if (!report.goals.empty()) text += Markdown(GoalTable(report.goals));
  text += fmt::format("\n![{}](experiments/{}.svg)\n", experiment.title, experiment.name);
  if (!report.remarks.empty()) text += "\n";
  for (const std::string& remark : report.remarks) text += fmt::format("- {}\n", remark);
  return text;
}

std::string TerminalText(const Experiment& experiment, const ExperimentReport& report) {
  std::string text = fmt::format("{}\n", experiment.title);
  for (const Table& table : report.tables) text += Aligned(table);
  if (!report.goals.empty()) text += Aligned(GoalTable(report.goals));
  if (!report.remarks.empty()) text += "\n";
  for (const std::string& remark : report.remarks) text += fmt::format("- {}\n", remark);
  return text;
}

Result<std::string> WithSection(const std::string& page, const std::string& name,
                                const std::string& section) {
  RETURN_IF_ERROR(CheckPage(page));
  std::string text = page.empty() ? std::string(kPageMark) + kHead : page;
  const std::string block = fmt::format("\n{}{}{}", Begin(name), section, End(name));
  std::size_t place = std::string::npos;  // behind the last section that comes before this one
  for (const Experiment& other : Experiments()) {
    const std::size_t begin = text.find(Begin(other.name));
    const std::size_t end = text.find(End(other.name));
    if ((begin == std::string::npos) != (end == std::string::npos) ||
        (begin != std::string::npos && end < begin)) {
      return Fail(ErrorCode::kInvalidArgument,
                  "experiments.md: the marks of section {} do not pair: it is left as it is", other.name);
    }
    const std::size_t behind = end == std::string::npos ? end : end + End(other.name).size();
    if (other.name == name && begin != std::string::npos) {
      return text.replace(begin - 1, behind - begin + 1, block);  // with the empty line before it
    }
    if (other.name == name) break;
    if (behind != std::string::npos) place = behind;
  }
  if (place == std::string::npos) place = std::min(text.find("\n<!-- begin: "), text.size());
  return text.insert(place, block);
}

Status CheckPlace(const fs::path& folder, const std::string& name) {
  if (!fs::is_directory(folder)) {
    return Fail(ErrorCode::kNotFound, "{} is not a folder", folder.string());
  }
  ASSIGN_OR_RETURN(const std::string page, TextOf(PagePath(folder)));
  RETURN_IF_ERROR(WithSection(page, name, ""));
  const fs::path path = PicturePath(folder, name);
  ASSIGN_OR_RETURN(const std::string picture, TextOf(path));
  if (picture.empty() || picture.find(PictureMark(name)) != std::string::npos) return {};
  return Fail(ErrorCode::kInvalidArgument, "{} was not written by forgescan experiment: it is left as it is",
              path.string());
}

Status WriteExperiment(const fs::path& folder, const std::string& name, const std::string& section,
                       const std::string& svg) {
  RETURN_IF_ERROR(CheckPlace(folder, name));
  ASSIGN_OR_RETURN(const std::string page, TextOf(PagePath(folder)));
  ASSIGN_OR_RETURN(const std::string text, WithSection(page, name, section));
  std::error_code problem;
  fs::create_directories(folder / "experiments", problem);
  if (problem) {
    return Fail(ErrorCode::kIo, "{}: {}", (folder / "experiments").string(), problem.message());
  }
  RETURN_IF_ERROR(WriteOutputFile(PicturePath(folder, name), svg));
  return WriteOutputFile(PagePath(folder), text);
}

}  // namespace forgescan
