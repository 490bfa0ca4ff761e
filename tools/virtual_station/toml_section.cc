#include "tools/virtual_station/toml_section.h"

#include <cmath>

namespace forgescan {

TomlSection::TomlSection(const toml::table* table, std::string place)
    : table_(table), place_(std::move(place)) {
  if (table_ == nullptr) {
    complaint_ = fmt::format("{}: the section is missing", place_);
  }
}

void TomlSection::Blame(const std::string& key, const std::string& what) {
  if (complaint_.empty()) {
    complaint_ = fmt::format("{}: {} {}", place_, key, what);
  }
}

const toml::node* TomlSection::Find(const std::string& key) {
  known_.insert(key);
  const toml::node* node = table_ == nullptr ? nullptr : table_->get(key);
  if (node == nullptr) {
    Blame(key, "is missing");
  }
  return node;
}

double TomlSection::Checked(const toml::node& node, const std::string& key, Range range) {
  if (!node.is_number()) {
    Blame(key, fmt::format("must be a number, {} to {}", range.low, range.high));
    return range.low;
  }
  const double value = *node.value<double>();
  if (!(value >= range.low && value <= range.high)) {
    Blame(key, fmt::format("is {}, allowed {} to {}", value, range.low, range.high));
    return range.low;
  }
  return value;
}

double TomlSection::Number(const std::string& key, Range range) {
  const toml::node* node = Find(key);
  return node == nullptr ? range.low : Checked(*node, key, range);
}

int TomlSection::Integer(const std::string& key, Range range) {
  const toml::node* node = Find(key);
  if (node == nullptr) {
    return static_cast<int>(range.low);
  }
  if (!node->is_integer()) {
    Blame(key, fmt::format("must be a whole number, {} to {}", range.low, range.high));
    return static_cast<int>(range.low);
  }
  return static_cast<int>(Checked(*node, key, range));
}

std::string TomlSection::Text(const std::string& key) {
  const toml::node* node = Find(key);
  if (node != nullptr && !node->is_string()) {
    Blame(key, "must be a text");
  }
  return node != nullptr && node->is_string() ? *node->value<std::string>() : std::string();
}

Eigen::Vector3d TomlSection::Vector3(const std::string& key, Range range) {
  const toml::node* node = Find(key);
  const toml::array* array = node == nullptr ? nullptr : node->as_array();
  if (array == nullptr || array->size() != 3) {
    Blame(key, fmt::format("must be an array of three numbers, {} to {}", range.low, range.high));
    return Eigen::Vector3d::Constant(range.low);
  }
  return {Checked(array->at(0), key, range), Checked(array->at(1), key, range),
          Checked(array->at(2), key, range)};
}

Status TomlSection::Finish() {
  if (complaint_.empty()) {
    for (const auto& [key, value] : *table_) {
      if (!known_.contains(std::string(key.str()))) {
        Blame(std::string(key.str()), "is not a key of this section");
      }
    }
  }
  return complaint_.empty() ? Status() : Fail(ErrorCode::kFormat, "{}", complaint_);
}

}  // namespace forgescan
