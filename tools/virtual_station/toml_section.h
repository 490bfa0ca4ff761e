// Strict reading of one TOML table: every key is asked for by name with its limits, every other key is an
// error.
#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <set>
#include <string>

#include "services/common/result.h"

namespace forgescan {

struct Range {
  double low, high;
};

// Ask for keys, then call Finish(): it tells the first thing that was wrong. Until then a wrong value reads
// as the lower limit or as nothing, so a section's values may be used only after Finish() was ok.
class TomlSection {
 public:
  // `place` is for messages: file and section. A null table means that the section is missing.
  TomlSection(const toml::table* table, std::string place);

  double Number(const std::string& key, Range range);
  int Integer(const std::string& key, Range range);
  std::string Text(const std::string& key);
  Eigen::Vector3d Vector3(const std::string& key, Range range);

  // kFormat: a missing, mistyped, out-of-range or unknown key. `place: key ...`.
  Status Finish();

 private:
  void Blame(const std::string& key, const std::string& what);
  const toml::node* Find(const std::string& key);
  double Checked(const toml::node& node, const std::string& key, Range range);

  const toml::table* table_;
  std::string place_;
  std::set<std::string> known_;
  std::string complaint_;
};

}  // namespace forgescan
