#include "services/recorder/recording_store.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace forgescan {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolders[] = {"parts", "station"};

}  // namespace

Result<RecordingStore> RecordingStore::Open(const std::string& folder) {
  for (const char* name : kFolders) {
    const fs::path path = fs::path(folder) / name;
    std::error_code problem;
    fs::create_directories(path, problem);
    if (problem || access(path.c_str(), R_OK | W_OK | X_OK) != 0) {
      return Fail(ErrorCode::kIo, "the recordings cannot be kept in {}: {}", path.string(),
                  problem ? problem.message() : std::strerror(errno));
    }
  }
  return RecordingStore(folder);
}

std::string RecordingStore::PathOf(const RecordingName& name) const {
  RecordingName shown = name;
  std::string text = NameOf(shown);
  if (!name.closed) {
    text.resize(text.size() - std::string_view(".part").size());
  }
  return (fs::path(folder_) / (name.part.has_value() ? "parts" : "station") / text).string();
}

Result<std::int64_t> RecordingStore::FreeBytes() const {
  std::error_code problem;
  const fs::space_info space = fs::space(folder_, problem);
  if (problem) {
    return Fail(ErrorCode::kIo, "the free space of {} cannot be told: {}", folder_, problem.message());
  }
  return static_cast<std::int64_t>(space.available);
}

Result<std::vector<StoredRecording>> RecordingStore::List() const {
  std::vector<StoredRecording> files;
  for (const char* name : kFolders) {
    std::error_code problem;
    const fs::path folder = fs::path(folder_) / name;
    for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end;
         entry.increment(problem)) {
      std::error_code gone;  // deleted by somebody meanwhile
      const bool regular = entry->is_regular_file(gone) && !entry->is_symlink(gone);
      const auto bytes = regular ? entry->file_size(gone) : 0;
      if (regular && !gone && ParseRecordingName(entry->path().filename().string()).has_value()) {
        files.push_back({entry->path().string(), static_cast<std::int64_t>(bytes), false});
      }
    }
    if (problem) {
      return Fail(ErrorCode::kIo, "{} cannot be listed: {}", folder.string(), problem.message());
    }
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

PruneOutcome RecordingStore::Prune(const RetentionRules& rules, const std::vector<std::string>& open,
                                   std::int64_t now_us) const {
  auto files = List();
  if (!files.ok()) {
    return {{}, {files.error().message}};
  }
  for (StoredRecording& file : *files) {
    file.open = std::find(open.begin(), open.end(), file.path) != open.end();
  }
  PruneOutcome outcome;
  const RetentionPlan plan = PlanRetention(*files, rules, now_us);
  for (const Deletion& deletion : plan.deletions) {
    std::error_code problem;
    if (fs::remove(deletion.path, problem)) {
      outcome.deleted.push_back(deletion);
    } else {
      outcome.errors.push_back(fmt::format("{} cannot be deleted ({})", deletion.path, problem.message()));
    }
  }
  if (plan.bytes_over_quota > 0) {
    outcome.errors.push_back(
        fmt::format("the recordings in {} exceed their quota by {} bytes, and nothing more may be deleted",
                    folder_, plan.bytes_over_quota));
  }
  return outcome;
}

}  // namespace forgescan
