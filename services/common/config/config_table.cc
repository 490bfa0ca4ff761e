#include <cmath>

#include "services/common/config/config_node.h"

namespace forgescan {
namespace {

std::string Show(const toml::node& node) {
  std::string text;
  node.visit([&text](const auto& value) {
    if constexpr (toml::is_string<decltype(value)>) {
      text = fmt::format("\"{}\"", value.get());
    } else if constexpr (toml::is_number<decltype(value)>) {
      text = fmt::format("{}", value.get());
    } else if constexpr (toml::is_boolean<decltype(value)>) {
      text = value.get() ? "true" : "false";
    } else {
      text = "not a single value";
    }
  });
  return text;
}

std::optional<double> AsNumber(const toml::node& node) {
  if (!node.is_number()) {
    return std::nullopt;
  }
  const auto value = node.value<double>();
  return value.has_value() && std::isfinite(*value) ? value : std::nullopt;
}

}  // namespace

ConfigTable::ConfigTable(std::shared_ptr<Node> node) : node_(std::move(node)) {}
ConfigTable::ConfigTable(ConfigTable&&) noexcept = default;
ConfigTable& ConfigTable::operator=(ConfigTable&&) noexcept = default;
ConfigTable::~ConfigTable() = default;

void ConfigTable::Optional(std::string_view key, double& value, double min, double max) {
  const toml::node* found = node_->Find(key);
  if (found == nullptr) {
    return;
  }
  const auto number = AsNumber(*found);
  if (!number.has_value() || *number < min || *number > max) {
    node_->Fault(ErrorCode::kInvalidArgument, key,
                 fmt::format("is {}, but must be a number from {} to {}", Show(*found), min, max));
    return;
  }
  value = *number;
}

void ConfigTable::Optional(std::string_view key, std::int64_t& value, std::int64_t min, std::int64_t max) {
  const toml::node* found = node_->Find(key);
  if (found == nullptr) {
    return;
  }
  const auto* number = found->as_integer();
  if (number == nullptr || number->get() < min || number->get() > max) {
    node_->Fault(ErrorCode::kInvalidArgument, key,
                 fmt::format("is {}, but must be a whole number from {} to {}", Show(*found), min, max));
    return;
  }
  value = number->get();
}

void ConfigTable::Optional(std::string_view key, int& value, int min, int max) {
  std::int64_t wide = value;
  Optional(key, wide, std::int64_t{min}, std::int64_t{max});
  value = static_cast<int>(wide);
}

void ConfigTable::Optional(std::string_view key, bool& value) {
  const toml::node* found = node_->Find(key);
  if (found == nullptr) {
    return;
  }
  if (!found->is_boolean()) {
    node_->Fault(ErrorCode::kInvalidArgument, key,
                 fmt::format("is {}, but must be true or false", Show(*found)));
    return;
  }
  value = found->as_boolean()->get();
}

void ConfigTable::Optional(std::string_view key, std::string& value) {
  const toml::node* found = node_->Find(key);
  if (found == nullptr) {
    return;
  }
  if (!found->is_string() || found->as_string()->get().empty()) {
    node_->Fault(ErrorCode::kInvalidArgument, key, fmt::format("is {}, but must be a text", Show(*found)));
    return;
  }
  value = found->as_string()->get();
}

void ConfigTable::Optional(std::string_view key, std::vector<std::string>& value) {
  const toml::node* found = node_->Find(key);
  if (found == nullptr) {
    return;
  }
  const toml::array* array = found->as_array();
  std::vector<std::string> texts;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    const auto* text = array->get(i)->as_string();
    if (text == nullptr || text->get().empty()) {
      array = nullptr;
      break;
    }
    texts.push_back(text->get());
  }
  if (array == nullptr) {
    node_->Fault(ErrorCode::kInvalidArgument, key, "must be a list of texts");
    return;
  }
  value = std::move(texts);
}

void ConfigTable::Required(std::string_view key, double& value, double min, double max) {
  Has(key) ? Optional(key, value, min, max)
           : node_->Missing(key, fmt::format("a number from {} to {}", min, max));
}

void ConfigTable::Required(std::string_view key, std::int64_t& value, std::int64_t min, std::int64_t max) {
  Has(key) ? Optional(key, value, min, max)
           : node_->Missing(key, fmt::format("a whole number from {} to {}", min, max));
}

void ConfigTable::Required(std::string_view key, int& value, int min, int max) {
  Has(key) ? Optional(key, value, min, max)
           : node_->Missing(key, fmt::format("a whole number from {} to {}", min, max));
}

void ConfigTable::Required(std::string_view key, bool& value) {
  Has(key) ? Optional(key, value) : node_->Missing(key, "true or false");
}

void ConfigTable::Required(std::string_view key, std::string& value) {
  Has(key) ? Optional(key, value) : node_->Missing(key, "a text");
}

void ConfigTable::Required(std::string_view key, std::vector<std::string>& value) {
  Has(key) ? Optional(key, value) : node_->Missing(key, "a list of texts");
}

void ConfigTable::Required(std::string_view key, std::vector<double>& value, std::size_t count, double min,
                           double max) {
  const toml::node* found = node_->Find(key);
  const std::string wanted = count == 0 ? fmt::format("a list of numbers from {} to {}", min, max)
                                        : fmt::format("a list of {} numbers from {} to {}", count, min, max);
  if (found == nullptr) {
    return node_->Missing(key, wanted);
  }
  const toml::array* array = found->as_array();
  std::vector<double> numbers;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    const auto number = AsNumber(*array->get(i));
    if (number.has_value() && *number >= min && *number <= max) {
      numbers.push_back(*number);
    }
  }
  if (array == nullptr || numbers.size() != array->size() || (count != 0 && numbers.size() != count)) {
    return node_->Fault(ErrorCode::kInvalidArgument, key, fmt::format("must be {}", wanted));
  }
  value = std::move(numbers);
}

bool ConfigTable::Has(std::string_view key) const {
  return node_->table != nullptr && node_->table->contains(key);
}

ConfigTable ConfigTable::Table(std::string_view key) {
  const toml::node* found = node_->Find(key);
  if (found != nullptr && !found->is_table()) {
    node_->Fault(ErrorCode::kInvalidArgument, key, "must be a table");
  }
  auto child = std::make_shared<Node>();
  child->document = node_->document;
  child->table = found != nullptr ? found->as_table() : nullptr;
  child->file = node_->file;
  child->path = node_->Name(key);
  node_->children.push_back(child);
  return ConfigTable(std::move(child));
}

std::vector<ConfigTable> ConfigTable::Tables(std::string_view key) {
  const toml::node* found = node_->Find(key);
  std::vector<ConfigTable> tables;
  const toml::array* array = found != nullptr ? found->as_array() : nullptr;
  if (found != nullptr && array == nullptr) {
    node_->Fault(ErrorCode::kInvalidArgument, key, "must be a list of tables");
  }
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    auto child = std::make_shared<Node>();
    child->document = node_->document;
    child->table = array->get(i)->as_table();
    child->file = node_->file;
    child->path = fmt::format("{}[{}]", node_->Name(key), i);
    if (child->table == nullptr) {
      node_->Fault(ErrorCode::kInvalidArgument, key, "must be a list of tables");
    }
    node_->children.push_back(child);
    tables.push_back(ConfigTable(std::move(child)));
  }
  return tables;
}

std::vector<std::string> ConfigTable::TableNames() {
  std::vector<std::string> names;
  if (node_->table == nullptr) {
    return names;
  }
  for (const auto& [key, value] : *node_->table) {
    node_->seen.emplace(key.str());
    if (!value.is_table()) {
      node_->Fault(ErrorCode::kInvalidArgument, key.str(), "must be a table");
    }
    names.emplace_back(key.str());
  }
  return names;
}

void ConfigTable::Reject(std::string_view key, std::string_view what) {
  node_->Fault(ErrorCode::kInvalidArgument, key, what);
}

Status ConfigTable::Finish() {
  if (node_->error.has_value()) {
    return *node_->error;
  }
  for (const auto& child : node_->children) {
    RETURN_IF_ERROR(ConfigTable(child).Finish());
  }
  if (node_->table == nullptr) {
    return {};
  }
  for (const auto& [key, value] : *node_->table) {
    if (!node_->seen.contains(key.str())) {
      return Fail(ErrorCode::kInvalidArgument, "{}: line {}: unknown key {}; known here: {}", node_->file,
                  value.source().begin.line, node_->Name(key.str()), fmt::join(node_->seen, ", "));
    }
  }
  return {};
}

}  // namespace forgescan
