// A new log with what is undamaged in an old one.
#pragma once

#include <string>

#include "services/common/result.h"

namespace forgescan {

// Copies every undamaged event: not those whose stream CRC is wrong, that do not decode as their type, or
// that are too short for a type; an event of an unknown type cannot be judged and is copied. The old log is
// only read. Prints a line for each thing left out. Errors: as LogReader::Open() and LogWriter.
Status RepairLog(const std::string& file, const std::string& out);

}  // namespace forgescan
