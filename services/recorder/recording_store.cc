#include "services/recorder/recording_store.h"

#include <sys/stat.h>
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

Result<std::shared_ptr<const OwnedFd>> Lock(const std::string& folder) {
  auto file = LockFile((fs::path(folder) / "recorder.lock").string());
  if (file.ok()) {
    return std::make_shared<const OwnedFd>(std::move(*file));
  }
  const bool held = file.error().code == ErrorCode::kUnavailable;
  return Fail(file.error().code, "the recordings cannot be kept in {}: {}", folder,
              held ? "another recorder keeps its recordings there" : file.error().message);
}

// Each folder may be on a disk of its own.
Result<FreeSpace> FreeOf(const std::string& folder) {
  FreeSpace free;
  for (const char* name : kFolders) {
    std::error_code problem;
    const fs::path path = fs::path(folder) / name;
    const fs::space_info space = fs::space(path, problem);
    struct stat status {};
    if (problem || stat(path.c_str(), &status) != 0) {
      return Fail(ErrorCode::kIo, "the free space of {} cannot be told: {}", path.string(),
                  problem ? problem.message() : std::strerror(errno));
    }
    free[status.st_dev] = static_cast<std::int64_t>(space.available);
  }
  return free;
}

// A recording's file; nothing for anything else, and for what somebody has deleted meanwhile.
std::optional<StoredRecording> RecordingAt(const fs::path& path) {
  struct stat status {};
  if (!ParseRecordingName(path.filename().string()) || lstat(path.c_str(), &status) != 0 ||
      !S_ISREG(status.st_mode)) {
    return std::nullopt;
  }
  const std::int64_t changed_us = status.st_mtim.tv_sec * 1'000'000 + status.st_mtim.tv_nsec / 1000;
  return StoredRecording{path.string(), status.st_size, false, changed_us, status.st_dev};
}

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
  ASSIGN_OR_RETURN(auto lock, Lock(folder));
  return RecordingStore(folder, std::move(lock));
}

std::string RecordingStore::PathOf(const RecordingName& name) const {
  fs::path file = NameOf(name);
  if (!name.closed) {
    file.replace_extension();  // .part
  }
  return (fs::path(folder_) / (name.part.has_value() ? "parts" : "station") / file).string();
}

Result<std::int64_t> RecordingStore::FreeBytes() const {
  ASSIGN_OR_RETURN(const FreeSpace free, FreeOf(folder_));
  return std::min_element(free.begin(), free.end(),
                          [](const auto& x, const auto& y) { return x.second < y.second; })
      ->second;
}

Result<std::vector<StoredRecording>> RecordingStore::List() const {
  std::vector<StoredRecording> files;
  for (const char* name : kFolders) {
    std::error_code problem;
    const fs::path folder = fs::path(folder_) / name;
    for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end;
         entry.increment(problem)) {
      if (auto file = RecordingAt(entry->path())) {
        files.push_back(std::move(*file));
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
    return {{}, {files.error().message}, ""};
  }
  for (StoredRecording& file : *files) {
    file.open = std::find(open.begin(), open.end(), file.path) != open.end();
  }
  const auto free = FreeOf(folder_);
  if (!free.ok()) {
    return {{}, {free.error().message}, ""};
  }
  PruneOutcome outcome;
  const RetentionPlan plan = PlanRetention(*files, rules, *free, now_us);
  outcome.doubt = plan.doubt;
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
