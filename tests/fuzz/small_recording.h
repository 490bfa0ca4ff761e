// A recording of a few kilobytes, as the recorder would write it.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "services/common/input_file.h"
#include "tests/tools/forgescan/test_recording.h"

namespace forgescan::fuzz {

// Writes it to `path` (which does not exist) and returns its bytes.
inline std::string SmallRecording(const std::filesystem::path& path) {
  TestRecording::Make().WriteTo(path.string());
  return ReadInputFile(path).value();
}

}  // namespace forgescan::fuzz
