// The folder of the recordings.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/common/locked_file.h"
#include "services/common/result.h"
#include "services/recorder/recording_name.h"
#include "services/recorder/retention.h"

namespace forgescan {

struct PruneOutcome {
  std::vector<Deletion> deleted;
  std::vector<std::string> errors;
  std::string doubt;  // as in RetentionPlan
};

class RecordingStore {
 public:
  // Makes the folders, and locks them for as long as this or a copy of it lives: two recorders on one folder
  // would take each other's open files for left-overs. Errors: kIo (they cannot be made, or not be written),
  // kUnavailable (another recorder has them).
  static Result<RecordingStore> Open(const std::string& folder);

  const std::string& folder() const { return folder_; }
  // Where a recording is while it is open, without the ending .part; where it is when it is closed.
  std::string PathOf(const RecordingName& name) const;
  // On the disk of the parts or of the station's recordings, the smaller. Errors: kIo.
  Result<std::int64_t> FreeBytes() const;
  // Every file with the name of a recording. Errors: kIo.
  Result<std::vector<StoredRecording>> List() const;
  // Deletes what the rules let go. `open`: paths of the files that are being written.
  PruneOutcome Prune(const RetentionRules& rules, const std::vector<std::string>& open,
                     std::int64_t now_us) const;

 private:
  RecordingStore(std::string folder, std::shared_ptr<const OwnedFd> lock)
      : folder_(std::move(folder)), lock_(std::move(lock)) {}

  std::string folder_;
  std::shared_ptr<const OwnedFd> lock_;
};

}  // namespace forgescan
