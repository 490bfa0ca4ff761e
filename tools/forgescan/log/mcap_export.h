// A log as an MCAP file, for Foxglove and other viewers.
#pragma once

#include <string>

#include "services/common/result.h"

namespace forgescan {

// Every message in JSON under its channel's name, with a schema made of its definition: images as
// foxglove.CompressedImage (PNG), whole clouds as foxglove.PointCloud (coordinates in m, as viewers expect),
// the others field by field. Times: that of recording, and that of the message's event as time of publishing.
// Errors: kInvalidArgument (the file exists), kUntrusted (the log is damaged, or some of it could not be
// exported; the rest is there), kIo, those of LogReader::Open().
Status ExportMcap(const std::string& file, const std::string& mcap);

}  // namespace forgescan
