// A log as files that other programs read.
#pragma once

#include <string>

#include "services/common/result.h"

namespace forgescan {

struct LogExport {
  std::string folder;
  bool images = false, clouds = false, messages = false;  // none = all
};

// Makes the folder: images PART_VIEW_ATTEMPT_CAMERA_PATTERN.png, clouds CHANNEL_PART_VIEW.ply, everything
// else CHANNEL.jsonl, one message a line with the time of recording. Where a name is taken, as by another
// part with the same number, the time is added. The folder appears when all is written. Errors:
// kInvalidArgument (the folder exists), kUntrusted (the log is damaged, or some of it could not be exported;
// the rest is there), kIo, those of LogReader::Open().
Status ExportLog(const std::string& file, const LogExport& what);

}  // namespace forgescan
