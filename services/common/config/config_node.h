// What is behind ConfigTable and ConfigFile: only for config_table.cc and config_file.cc, so that nobody else
// compiles against the TOML parser.
#pragma once

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>
#define TOML_EXCEPTIONS 0
#define TOML_HEADER_ONLY 1
#include <toml++/toml.h>

#include "services/common/config/config.h"

namespace forgescan {

struct ConfigFile::Document {
  toml::table table;
};

// A table being read. Children are kept so that Finish() sees the whole tree.
struct ConfigTable::Node {
  std::shared_ptr<const void> document;  // keeps `table` alive
  const toml::table* table = nullptr;    // null = the file has no such table
  std::string file;
  std::string path;  // dotted name of the table, empty for the root
  std::set<std::string, std::less<>> seen;
  std::optional<Error> error;
  std::vector<std::shared_ptr<Node>> children;

  std::string Name(std::string_view key) const {
    return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
  }
  const toml::node* Find(std::string_view key) {
    seen.emplace(key);
    return table != nullptr ? table->get(key) : nullptr;
  }
  void Fault(ErrorCode code, std::string_view key, std::string_view what) {
    if (!error.has_value()) {
      error = Fail(code, "{}: {} {}", file, Name(key), what);
    }
  }
  void Missing(std::string_view key, std::string_view what) {
    Fault(ErrorCode::kNotFound, key, fmt::format("is missing: {} is required", what));
  }
};

}  // namespace forgescan
