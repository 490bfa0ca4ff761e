#include <libdeflate.h>

#include <algorithm>

#include "services/common/config/config_node.h"
#include "services/common/config/toml_text.h"
#include "services/common/input_file.h"

namespace forgescan {

Result<ConfigFile> ConfigFile::Load(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(path));
  return Parse(text, path);
}

Result<ConfigFile> ConfigFile::Parse(std::string_view text, const std::string& name) {
  RETURN_IF_ERROR(CheckTomlText(text, name));
  toml::parse_result parsed = toml::parse(text, name);
  if (!parsed) {
    const auto& at = parsed.error().source().begin;
    return Fail(ErrorCode::kFormat, "{}: line {}, column {}: {}", name, at.line, at.column,
                parsed.error().description());
  }
  ConfigFile file;
  file.path_ = name;
  file.hash_ = fmt::format("{:08x}", libdeflate_crc32(0, text.data(), text.size()));
  file.document_ = std::make_shared<Document>(Document{std::move(parsed).table()});
  return file;
}

ConfigTable ConfigFile::Root() const {
  auto node = std::make_shared<ConfigTable::Node>();
  node->document = document_;
  node->table = &document_->table;
  node->file = path_;
  return ConfigTable(std::move(node));
}

ConfigTable ConfigFile::Table(std::string_view key) const { return Root().Table(key); }

Status ConfigFile::OnlyTables(const std::vector<std::string>& known) const {
  for (const auto& [key, value] : document_->table) {
    if (std::find(known.begin(), known.end(), key.str()) == known.end()) {
      return Fail(ErrorCode::kInvalidArgument, "{}: line {}: unknown table {}; known here: {}", path_,
                  value.source().begin.line, key.str(), fmt::join(known, ", "));
    }
    if (!value.is_table()) {
      return Fail(ErrorCode::kInvalidArgument, "{}: line {}: {} must be a table", path_,
                  value.source().begin.line, key.str());
    }
  }
  return {};
}

}  // namespace forgescan
