// Reads a TOML file into the config structs of the services: every key is either read or an error, every
// number has limits.
//
//   ASSIGN_OR_RETURN(ConfigFile file, ConfigFile::Load(path));
//   ConfigTable table = file.Table("trigger");
//   TriggerConfig config;                                          // its members' initial values are the
//   defaults table.Required("pulse_period_us", config.pulse_period_us, 1000, 1'000'000);
//   table.Optional("settle_ms", config.settle_ms, 0.0, 5000.0);
//   RETURN_IF_ERROR(table.Finish());                               // first wrong, missing or unknown key of
//   the table
//
// Errors name file, key and limits in one sentence. A failed read leaves the member as it was; the struct may
// only be used once Finish() succeeded.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

class ConfigTable {
 public:
  ConfigTable(ConfigTable&&) noexcept;
  ConfigTable& operator=(ConfigTable&&) noexcept;
  ~ConfigTable();

  void Required(std::string_view key, double& value, double min, double max);
  void Required(std::string_view key, std::int64_t& value, std::int64_t min, std::int64_t max);
  void Required(std::string_view key, int& value, int min, int max);
  void Required(std::string_view key, bool& value);
  void Required(std::string_view key, std::string& value);  // not empty
  void Required(std::string_view key, std::vector<std::string>& value);
  // Exactly `count` numbers; 0 = any number of them.
  void Required(std::string_view key, std::vector<double>& value, std::size_t count, double min, double max);

  void Optional(std::string_view key, double& value, double min, double max);
  void Optional(std::string_view key, std::int64_t& value, std::int64_t min, std::int64_t max);
  void Optional(std::string_view key, int& value, int min, int max);
  void Optional(std::string_view key, bool& value);
  void Optional(std::string_view key, std::string& value);
  void Optional(std::string_view key, std::vector<std::string>& value);

  bool Has(std::string_view key) const;
  // A table below this one. A missing one is an empty table, whose required keys then are the error.
  ConfigTable Table(std::string_view key);
  // The tables of [[key]], in file order; none if there is no such key.
  std::vector<ConfigTable> Tables(std::string_view key);
  // Names of the tables below this one, in alphabetical order; anything but a table in it is an error.
  // Whoever reads those tables finishes them.
  std::vector<std::string> TableNames();
  // Takes note of a wrong value that only the caller can judge: "<file>: <key> <what>".
  void Reject(std::string_view key, std::string_view what);

  // The first error of this table and every table taken from it; else the first key nobody asked for.
  [[nodiscard]] Status Finish();

 private:
  friend class ConfigFile;
  struct Node;
  explicit ConfigTable(std::shared_ptr<Node> node);
  std::shared_ptr<Node> node_;
};

class ConfigFile {
 public:
  // Errors: kNotFound/kIo (no such file), kFormat (not TOML; with line and column).
  static Result<ConfigFile> Load(const std::string& path);
  static Result<ConfigFile> Parse(std::string_view text, const std::string& name);

  const std::string& path() const { return path_; }
  // CRC-32 of the text as read, hexadecimal: tells two configurations apart in logs and reports.
  const std::string& hash() const { return hash_; }
  // The table of the whole file; Finish() on it checks the whole file.
  ConfigTable Root() const;
  // One table of the file; Finish() on it checks that table only.
  ConfigTable Table(std::string_view key) const;
  // Error if the file has a top-level key that is not in the list, or is no table.
  [[nodiscard]] Status OnlyTables(const std::vector<std::string>& known) const;

 private:
  struct Document;
  std::string path_;
  std::string hash_;
  std::shared_ptr<Document> document_;
};

}  // namespace forgescan
