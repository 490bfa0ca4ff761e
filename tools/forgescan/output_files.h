// The files one command writes: all of them under their names, or none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

// Create() removes what an earlier call left under the outputs' names, so that a refusal never leaves an old
// result behind; the command then writes to Staged(output); Commit() gives all files their names. Without
// Commit() (a refusal) the destructor removes what was staged. Devices and pipes (/dev/stdout) cannot be
// staged and are written directly.
class OutputFiles {
 public:
  // inputs: files and folders the command reads. outputs: as the user named them; an empty name (an option
  // that was not given) is skipped. Errors, before anything is removed: kInvalidArgument when an output is an
  // input, lies in an input folder, is a folder or is named twice (links are followed); kNotFound when its
  // folder does not exist. kIo when an old output cannot be removed.
  static Result<OutputFiles> Create(const std::vector<std::filesystem::path>& inputs,
                                    const std::vector<std::filesystem::path>& outputs);
  OutputFiles(OutputFiles&& other) noexcept = default;
  OutputFiles& operator=(OutputFiles&&) = delete;
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;
  ~OutputFiles();

  // Where to write `output`, one of the non-empty names given to Create().
  const std::filesystem::path& Staged(const std::filesystem::path& output) const;

  // After every staged file was written. Errors: kIo; then none of the outputs exists.
  Status Commit();

 private:
  struct Output {
    std::filesystem::path named;   // by the user
    std::filesystem::path target;  // links followed
    std::filesystem::path staged;  // the target itself for a device
  };
  OutputFiles() = default;
  Status Add(const std::filesystem::path& output);

  std::vector<Output> outputs_;
};

}  // namespace forgescan
