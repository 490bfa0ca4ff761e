// Holds the layout and the include rules of CONTRIBUTING.md: who may include whom, where time and vendors may
// be named, how long a file may be.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
const fs::path kSource = FORGESCAN_SOURCE_DIR;

struct File {
  std::string path;  // from the repository's root
  std::vector<std::string> lines;
};

std::vector<File> Sources() {
  std::vector<File> files;
  for (const char* top : {"services", "drivers", "tools", "tests"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kSource / top)) {
      const auto extension = entry.path().extension();
      if (extension != ".cc" && extension != ".h") {
        continue;
      }
      File file{fs::relative(entry.path(), kSource).string(), {}};
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        file.lines.push_back(line);
      }
      files.push_back(std::move(file));
    }
  }
  return files;
}

bool StartsWith(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

// services/<name> of a path, or empty.
std::string ServiceOf(const std::string& path) {
  std::smatch match;
  static const std::regex service("^services/(\\w+)/");
  return std::regex_search(path, match, service) ? match[1].str() : std::string();
}

// Every include of the file: path as written.
std::vector<std::string> Includes(const File& file) {
  static const std::regex include("^#include [<\"]([^>\"]+)[>\"]");
  std::vector<std::string> includes;
  for (const std::string& line : file.lines) {
    std::smatch match;
    if (std::regex_search(line, match, include)) {
      includes.push_back(match[1]);
    }
  }
  return includes;
}

// Calls `check` with every (file, included path) of the tree.
template <typename Check>
void ForEachInclude(const Check& check) {
  int seen = 0;
  for (const File& file : Sources()) {
    for (const std::string& include : Includes(file)) {
      check(file.path, include);
      ++seen;
    }
  }
  EXPECT_GT(seen, 500);
}

TEST(Layout, AServiceIncludesNoOtherService) {
  ForEachInclude([](const std::string& path, const std::string& include) {
    const std::string from = ServiceOf(path), to = ServiceOf(include);
    const bool across = !from.empty() && !to.empty() && to != "common" && to != from;
    EXPECT_FALSE(across) << path << " includes " << include;
  });
}

TEST(Layout, DriversKnowNoMessagesAndNoServices) {
  ForEachInclude([](const std::string& path, const std::string& include) {
    if (StartsWith(path, "drivers/")) {
      EXPECT_FALSE(StartsWith(include, "fsmsg/")) << path << " includes " << include;
      const std::string service = ServiceOf(include);
      EXPECT_TRUE(service.empty() || service == "common") << path << " includes " << include;
    }
  });
}

TEST(Layout, ProductDoesNotIncludeToolsOrTests) {
  ForEachInclude([](const std::string& path, const std::string& include) {
    if (StartsWith(path, "services/") || StartsWith(path, "drivers/")) {
      EXPECT_FALSE(StartsWith(include, "tools/") || StartsWith(include, "tests/"))
          << path << " includes " << include;
    }
  });
}

TEST(Layout, TheSimulatorKnowsNoServiceAndNoMessage) {
  ForEachInclude([](const std::string& path, const std::string& include) {
    if (StartsWith(path, "tools/virtual_station/")) {
      const std::string service = ServiceOf(include);
      EXPECT_TRUE(service.empty() || service == "common") << path << " includes " << include;
      EXPECT_FALSE(StartsWith(include, "fsmsg/")) << path << " includes " << include;
    }
  });
}

TEST(Layout, ConcreteBusAndDriversOnlyInMain) {
  static const std::regex concrete(
      "^drivers/\\w+/\\w+_(aravis|socketcan|udp|canopen|sim)\\.h$|/lcm_bus\\.h$");
  ForEachInclude([](const std::string& path, const std::string& include) {
    const std::string name = fs::path(path).filename();
    const bool service = !ServiceOf(path).empty() && !StartsWith(path, "services/common/");
    if (service && name != "main.cc") {
      EXPECT_FALSE(std::regex_search(include, concrete)) << path << " includes " << include;
    }
  });
}

TEST(Layout, VendorHeadersStayInTheirFiles) {
  struct Rule {
    std::regex header;
    std::regex allowed;
  };
  const std::vector<Rule> rules = {
      {std::regex("^lcm/lcm"), std::regex("^services/common/bus/lcm_bus\\.cc$")},
      {std::regex("^lcm/eventlog"), std::regex("^services/common/log/log_writer\\.cc$|^tests/common/log/")},
      {std::regex("^arv\\.h$"), std::regex("^drivers/camera/\\w+\\.cc$|^tests/drivers/camera/")},
      {std::regex("^linux/can"), std::regex("^drivers/can/can_socketcan\\.cc$")},
      {std::regex("^sqlite3\\.h$"), std::regex("^services/report/|^tests/services/report/")},
      {std::regex("^embree"), std::regex("^tools/virtual_station/\\w+\\.cc$|^tests/bench/")},
      {std::regex("^(BRep|TopoDS|STEP|XCAF|gp_)"),
       std::regex("\\.cc$|_shape\\.h$")},  // private headers of shapes
  };
  ForEachInclude([&rules](const std::string& path, const std::string& include) {
    for (const Rule& rule : rules) {
      if (std::regex_search(include, rule.header)) {
        EXPECT_TRUE(std::regex_search(path, rule.allowed)) << path << " includes " << include;
      }
    }
  });
}

TEST(Layout, OneClock) {
  static const std::regex clock(
      "(system_clock|steady_clock|high_resolution_clock)::now|sleep_for|sleep_until|\\busleep\\(");
  // The clock itself, hardware and simulators that run in real time, and tests.
  static const std::regex allowed("^services/common/clock/|^drivers/|^tools/|^tests/");
  for (const File& file : Sources()) {
    for (const std::string& line : file.lines) {
      if (std::regex_search(line, clock)) {
        EXPECT_TRUE(std::regex_search(file.path, allowed)) << file.path << ": " << line;
      }
    }
  }
}

TEST(Layout, FilesAndMainsAreShort) {
  for (const File& file : Sources()) {
    const bool main = fs::path(file.path).filename() == "main.cc" && StartsWith(file.path, "services/");
    EXPECT_LE(file.lines.size(), main ? 60u : StartsWith(file.path, "tests/") ? 400u : 300u) << file.path;
  }
}

TEST(Layout, NoLeftoversOfEditorsAndMerges) {
  for (const char* top : {"services", "drivers", "tools", "tests", "docs", "cmake", "stations", "lcmtypes"}) {
    for (const auto& entry : fs::recursive_directory_iterator(kSource / top)) {
      const std::string extension = entry.path().extension();
      EXPECT_FALSE(extension == ".orig" || extension == ".rej" || extension == ".bak") << entry.path();
    }
  }
}

TEST(Layout, EveryServiceHasItsPageAndItsMain) {
  int services = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "services")) {
    const std::string name = entry.path().filename();
    if (!entry.is_directory() || name == "common") {
      continue;
    }
    for (const char* file : {"README.md", "main.cc", "CMakeLists.txt"}) {
      EXPECT_TRUE(fs::exists(entry.path() / file)) << name << " has no " << file;
    }
    EXPECT_TRUE(fs::exists(kSource / "tests/services" / name / "CMakeLists.txt")) << name << " has no tests";
    ++services;
  }
  EXPECT_GE(services, 9);
}

TEST(Layout, AddingAServiceTakesLessThanAHundredLines) {
  std::ifstream page(kSource / "docs/write-a-service.md");
  int lines = 0;
  for (std::string line; std::getline(page, line);) {
    ++lines;
  }
  EXPECT_GT(lines, 0);
  EXPECT_LT(lines, 100);
}

TEST(Layout, EverySourceIsInTheBuild) {
  for (const File& file : Sources()) {
    if (fs::path(file.path).extension() != ".cc") {
      continue;
    }
    const fs::path source = kSource / file.path;
    bool listed = false;
    for (fs::path folder = source.parent_path(); !listed && folder != kSource.parent_path();
         folder = folder.parent_path()) {
      std::ifstream stream(folder / "CMakeLists.txt");
      const std::string text{std::istreambuf_iterator<char>(stream), {}};
      listed = text.find(fs::relative(source, folder).string()) != std::string::npos;
    }
    EXPECT_TRUE(listed) << file.path << " is in no CMakeLists.txt";
  }
}

}  // namespace
