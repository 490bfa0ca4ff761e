// The folder of the recordings.
#pragma once

#include <string>
#include <vector>

#include "services/common/result.h"
#include "services/recorder/recording_name.h"
#include "services/recorder/retention.h"

namespace forgescan {

struct PruneOutcome {
  std::vector<Deletion> deleted;
  std::vector<std::string> errors;
};

class RecordingStore {
 public:
  // Makes the folders. Errors: kIo (they cannot be made, or not be written).
  static Result<RecordingStore> Open(const std::string& folder);

  const std::string& folder() const { return folder_; }
  // Where a recording is while it is open, without the ending .part; where it is when it is closed.
  std::string PathOf(const RecordingName& name) const;
  // Errors: kIo.
  Result<std::int64_t> FreeBytes() const;
  // Every file with the name of a recording. Errors: kIo.
  Result<std::vector<StoredRecording>> List() const;
  // Deletes what the rules let go. `open`: paths of the files that are being written.
  PruneOutcome Prune(const RetentionRules& rules, const std::vector<std::string>& open,
                     std::int64_t now_us) const;

 private:
  explicit RecordingStore(std::string folder) : folder_(std::move(folder)) {}
  std::string folder_;
};

}  // namespace forgescan
