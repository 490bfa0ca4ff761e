#include "tools/forgescan/replay/message_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/common/log/lcm_decode.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

// The fields that tell a message from others of its channel.
constexpr const char* kTitleFields[] = {"part", "view", "attempt", "camera", "pattern", "slice", "name"};
constexpr const char* kChecksum = "crc32";

std::string ValueText(const Json& value) {
  if (value.is_binary()) {
    return fmt::format("{} bytes", value.get_binary().size());
  }
  return value.is_null() ? "not a number" : value.dump();
}

std::string BytesDifference(const Json& recorded, const Json& now) {
  const auto& a = recorded.get_binary();
  const auto& b = now.get_binary();
  if (a.size() != b.size()) {
    return fmt::format("recorded {} bytes, now {}", a.size(), b.size());
  }
  std::size_t first = a.size(), count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] != b[i]) {
      first = std::min(first, i);
      ++count;
    }
  }
  return fmt::format("{} of {} bytes differ, the first at {}: recorded {}, now {}", count, a.size(), first,
                     a[first], b[first]);
}

void Compare(const std::string& name, const Json& recorded, const Json& now,
             std::vector<std::string>& lines) {
  if (recorded == now) {
    return;
  }
  if (recorded.is_object() && now.is_object()) {
    for (const auto& [key, value] : recorded.items()) {
      if (key != kChecksum) {
        Compare(name.empty() ? key : name + "." + key, value, now.value(key, Json()), lines);
      }
    }
  } else if (recorded.is_array() && now.is_array() && recorded.size() == now.size()) {
    for (std::size_t i = 0; i < recorded.size(); ++i) {
      Compare(fmt::format("{}[{}]", name, i), recorded[i], now[i], lines);
    }
  } else if (recorded.is_array() && now.is_array()) {
    lines.push_back(fmt::format("{}: recorded {} elements, now {}", name, recorded.size(), now.size()));
  } else if (recorded.is_binary() && now.is_binary()) {
    lines.push_back(name + ": " + BytesDifference(recorded, now));
  } else {
    lines.push_back(fmt::format("{}: recorded {}, now {}", name, ValueText(recorded), ValueText(now)));
  }
}

}  // namespace

std::string MessageTitle(const LcmTypes& types, const std::string& channel, ByteView message) {
  std::string title = channel;
  const Result<Json> fields = DecodeToJson(types, message);
  if (!fields.ok()) {
    return title;
  }
  for (const char* name : kTitleFields) {
    if (const auto field = fields->find(name); field != fields->end()) {
      title += fmt::format(" {} {}", name, ValueText(*field));
    }
  }
  return title;
}

std::vector<std::string> FieldDifferences(const LcmTypes& types, ByteView recorded, ByteView now,
                                          std::size_t limit) {
  const Result<Json> before = DecodeToJson(types, recorded), after = DecodeToJson(types, now);
  if (!before.ok() || !after.ok()) {
    return {before.ok() ? fmt::format("now: {}", after.error().message)
                        : fmt::format("recorded: {}", before.error().message)};
  }
  std::vector<std::string> lines;
  Compare("", *before, *after, lines);
  if (lines.empty()) {  // two that are not a number, and differ in their bits
    lines.emplace_back("the same values in other bits");
  }
  if (lines.size() > limit) {
    const std::size_t more = lines.size() - limit;
    lines.resize(limit);
    lines.push_back(fmt::format("and {} more fields", more));
  }
  return lines;
}

}  // namespace forgescan
