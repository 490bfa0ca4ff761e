#include "tools/forgescan/replay/recorded_station.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <sstream>
#define TOML_EXCEPTIONS 0
#define TOML_HEADER_ONLY 1
#include <toml++/toml.h>

#include "services/common/config/toml_text.h"
#include "services/common/input_file.h"
#include "services/common/output_file.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStationFile = "station.toml";

struct Role {
  const char* name;
  std::string Station::*path;
  std::array<std::string_view, 2> services;  // that read it
  bool optional = false;                     // a station may do without
};
constexpr Role kRoles[] = {{"calibration", &Station::calibration, {"reconstruction"}},
                           {"pattern", &Station::pattern, {"reconstruction"}},
                           {"views", &Station::views, {"fusion"}},
                           {"model", &Station::model, {"registration", "report"}},
                           {"features", &Station::features, {"report"}},
                           {"standing", &Station::standing, {"fusion"}, true}};

Result<toml::table> ParseToml(std::string_view text, const std::string& name) {
  RETURN_IF_ERROR(CheckTomlText(text, name));
  toml::parse_result parsed = toml::parse(text);
  if (!parsed) {
    return Fail(ErrorCode::kFormat, "{}: {} (line {})", name, parsed.error().description(),
                parsed.error().source().begin.line);
  }
  return std::move(parsed).table();
}

std::string TomlText(const toml::table& table) {
  std::ostringstream text;
  text << table << "\n";
  return text.str();
}

const fsmsg::recorded_file_t* FindFile(const RecordedSession& session, const std::string& role) {
  const auto found = std::find_if(session.files().begin(), session.files().end(), [&](const auto& file) {
    return file.name == role || fs::path(file.name).stem() == role;
  });
  return found == session.files().end() ? nullptr : &*found;
}

std::string TextOf(const fsmsg::recorded_file_t& file) { return {file.data.begin(), file.data.end()}; }

// Sets "a.b.c = value" in the table, making the tables on the way.
Status SetValue(toml::table& table, const std::string& change) {
  const std::size_t equals = change.find('=');
  const std::string key = change.substr(0, equals);
  if (equals == std::string::npos || key.find('.') == std::string::npos) {
    return Fail(ErrorCode::kInvalidArgument,
                "--set {}: wanted is table.key=value, e.g. fusion.view_timeout_s=30", change);
  }
  ASSIGN_OR_RETURN(const toml::table parsed, ParseToml(change, "--set " + change));
  const toml::table* from = &parsed;
  toml::table* to = &table;
  for (;;) {
    if (from->size() != 1) {
      return Fail(ErrorCode::kInvalidArgument,
                  "--set {}: gives {} values; wanted is one, table.key=value; repeat --set for more", change,
                  from->size());
    }
    const auto only = from->begin();
    const toml::table* below = only->second.as_table();
    if (below == nullptr) {
      to->insert_or_assign(only->first, only->second);
      return {};
    }
    const auto known = to->insert(only->first, toml::table{}).first;
    to = known->second.as_table();
    if (to == nullptr) {
      return Fail(ErrorCode::kInvalidArgument, "--set {}: {} is a value, not a table", change,
                  only->first.str());
    }
    from = below;
  }
}

std::string ValueText(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) {
    return fmt::format("{}", number->get());  // as short as it can be; TOML's printer writes all digits
  }
  std::ostringstream text;
  node.visit([&text](const auto& value) { text << value; });
  return text.str();
}

// Every value of the table with its dotted name.
void Flatten(const toml::table& table, const std::string& prefix,
             std::map<std::string, std::string>& values) {
  for (const auto& [name, node] : table) {
    const std::string key = prefix.empty() ? std::string(name.str()) : prefix + "." + std::string(name.str());
    if (const toml::table* below = node.as_table()) {
      Flatten(*below, key, values);
    } else {
      values[key] = ValueText(node);
    }
  }
}

Result<std::string> ConfigText(const RecordedSession& session, const StationChanges& changes) {
  const fsmsg::recorded_file_t* recorded = FindFile(session, kStationFile);
  if (recorded == nullptr && changes.config.empty()) {
    return Fail(ErrorCode::kNotFound, "the recording holds no {}", kStationFile);
  }
  std::string text;
  if (changes.config.empty()) {
    text = TextOf(*recorded);
  } else {
    ASSIGN_OR_RETURN(text, ReadInputFile(changes.config));
  }
  if (changes.values.empty()) {
    return text;
  }
  ASSIGN_OR_RETURN(toml::table table, ParseToml(text, kStationFile));
  for (const std::string& change : changes.values) {
    RETURN_IF_ERROR(SetValue(table, change));
  }
  return TomlText(table);
}

// The file of a role, the user's or the recorded one; its place in the folder.
Result<std::string> UnpackFile(const RecordedSession& session, const StationChanges& changes,
                               const std::string& role, const fs::path& folder) {
  if (const auto own = changes.files.find(role); own != changes.files.end()) {
    return fs::absolute(own->second).string();
  }
  const fsmsg::recorded_file_t* file = FindFile(session, role);
  if (file == nullptr) {
    return Fail(ErrorCode::kNotFound, "the recording holds no file for {}; --{} FILE gives one", role, role);
  }
  const fs::path path = folder / fs::path(file->name).filename();
  RETURN_IF_ERROR(WriteOutputFile(path, TextOf(*file)));
  return path.string();
}

// The table that a change of a value is in: "fusion" of "fusion.view_timeout_s=30".
std::string TableOf(const std::string& change) {
  std::string table = change.substr(0, change.find_first_of(".="));
  std::erase_if(table, [](char c) { return c == ' ' || c == '\t' || c == '"' || c == '\''; });
  return table;
}

}  // namespace

Status CheckUsed(const StationChanges& changes, const std::vector<std::string>& services) {
  const auto computed = [&services](std::string_view name) {
    return std::find(services.begin(), services.end(), name) != services.end();
  };
  for (const std::string& change : changes.values) {
    if (const std::string table = TableOf(change); !computed(table)) {
      return Fail(
          ErrorCode::kInvalidArgument,
          "--set {}: nothing that is computed here reads [{}], so it would change nothing; read are [{}]",
          change, table, fmt::join(services, "], ["));
    }
  }
  for (const Role& role : kRoles) {
    if (changes.files.contains(role.name) && std::ranges::none_of(role.services, computed)) {
      return Fail(ErrorCode::kInvalidArgument,
                  "--{0}: nothing that is computed here reads the file for {0}, so it would change nothing; "
                  "computed are {1}",
                  role.name, fmt::join(services, ", "));
    }
  }
  return {};
}

Result<Station> UnpackStation(const RecordedSession& session, const StationChanges& changes,
                              const fs::path& folder) {
  ASSIGN_OR_RETURN(const std::string config, ConfigText(session, changes));
  RETURN_IF_ERROR(WriteOutputFile(folder / kStationFile, config));
  ASSIGN_OR_RETURN(Station station, Station::Load(folder.string()));
  for (const Role& role : kRoles) {
    if (role.optional && (station.*role.path).empty() && !changes.files.contains(role.name)) continue;
    ASSIGN_OR_RETURN(station.*role.path, UnpackFile(session, changes, role.name, folder));
  }
  station.results = (folder / "results").string();
  return station;
}

Result<std::vector<std::string>> DescribeChanges(const RecordedSession& session, const Station& station) {
  std::vector<std::string> lines;
  const fsmsg::recorded_file_t* recorded = FindFile(session, kStationFile);
  std::map<std::string, std::string> before, now;
  if (recorded != nullptr) {
    ASSIGN_OR_RETURN(const toml::table table, ParseToml(TextOf(*recorded), kStationFile));
    Flatten(table, "", before);
  }
  ASSIGN_OR_RETURN(const std::string text, ReadInputFile(fs::path(station.folder) / kStationFile));
  ASSIGN_OR_RETURN(const toml::table table, ParseToml(text, kStationFile));
  Flatten(table, "", now);
  for (const auto& [key, value] : now) {
    const auto old = before.find(key);
    if (old == before.end() || old->second != value) {
      lines.push_back(fmt::format("{} = {}, recorded {}", key, value,
                                  old == before.end() ? "as the default" : "as " + old->second));
    }
  }
  for (const auto& [key, value] : before) {
    if (!now.contains(key)) {
      lines.push_back(fmt::format("{} as the default, recorded as {}", key, value));
    }
  }
  for (const Role& role : kRoles) {
    const fsmsg::recorded_file_t* file = FindFile(session, role.name);
    if ((station.*role.path).empty()) {
      if (file != nullptr) lines.push_back(fmt::format("{} is not used, recorded with a file", role.name));
      continue;
    }
    ASSIGN_OR_RETURN(const std::string used, ReadInputFile(station.*role.path));
    if (file == nullptr || TextOf(*file) != used) {
      lines.push_back(fmt::format("{} is another file: {}", role.name, station.*role.path));
    }
  }
  return lines;
}

}  // namespace forgescan
