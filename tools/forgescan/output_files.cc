#include "tools/forgescan/output_files.h"

#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <system_error>

#include "services/common/output_file.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

// Links followed as far as the path exists. Errors: kIo (a loop of links, no permission to look).
Result<fs::path> Followed(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  fs::path followed = error ? fs::path() : fs::weakly_canonical(absolute, error);
  if (error) {
    return Fail(ErrorCode::kIo, "{}: {}", path.string(), error.message());
  }
  return followed;
}

bool AreSameFile(const fs::path& a, const fs::path& b) {
  std::error_code error;
  return a == b || (fs::equivalent(a, b, error) && !error);  // equivalent: hard links
}

bool LiesIn(const fs::path& file, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
}

Status CheckAgainstInput(const fs::path& named, const fs::path& target, const fs::path& input) {
  ASSIGN_OR_RETURN(const fs::path source, Followed(input));
  std::error_code error;
  if (fs::is_directory(source, error)) {
    if (LiesIn(target, source)) {
      return Fail(ErrorCode::kInvalidArgument, "{}: would be written into the input folder {}",
                  named.string(), input.string());
    }
  } else if (AreSameFile(target, source)) {
    return Fail(ErrorCode::kInvalidArgument, "{}: is both input and output", named.string());
  }
  return {};
}

Status RemoveOld(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) {
    return Fail(ErrorCode::kIo, "{}: the old file cannot be removed: {}", path.string(), error.message());
  }
  return {};
}

}  // namespace

Result<OutputFiles> OutputFiles::Create(const std::vector<fs::path>& inputs,
                                        const std::vector<fs::path>& outputs) {
  OutputFiles files;
  for (const fs::path& output : outputs) {
    if (!output.empty()) {
      RETURN_IF_ERROR(files.Add(output));
    }
  }
  for (const Output& output : files.outputs_) {
    for (const fs::path& input : inputs) {
      RETURN_IF_ERROR(CheckAgainstInput(output.named, output.target, input));
    }
  }
  for (const Output& output : files.outputs_) {
    if (output.staged != output.target) {
      RETURN_IF_ERROR(RemoveOld(output.target));
    }
  }
  return files;
}

Status OutputFiles::Add(const fs::path& output) {
  const bool direct = IsDevice(output);  // a pipe behind /dev/stdout has no path that could be followed
  ASSIGN_OR_RETURN(const fs::path target, direct ? Result<fs::path>(output) : Followed(output));
  std::error_code error;
  if (fs::is_directory(target, error) || !target.has_filename()) {
    return Fail(ErrorCode::kInvalidArgument, "{}: is a folder, not a file to write", output.string());
  }
  if (!direct && !fs::is_directory(target.parent_path(), error)) {
    return Fail(ErrorCode::kNotFound, "{}: its folder does not exist", output.string());
  }
  for (const Output& other : outputs_) {
    if (AreSameFile(other.target, target)) {
      return Fail(ErrorCode::kInvalidArgument, "{}: two outputs would be written to this file",
                  output.string());
    }
  }
  fs::path staged = target;
  if (!direct) {
    staged.replace_filename(fmt::format(".{}.{}", getpid(), target.filename().string()));
  }
  outputs_.push_back({output, target, staged});
  return {};
}

OutputFiles::~OutputFiles() {
  for (const Output& output : outputs_) {
    if (output.staged != output.target) {
      std::error_code ignored;
      fs::remove(output.staged, ignored);
    }
  }
}

const fs::path& OutputFiles::Staged(const fs::path& output) const {
  const auto found = std::find_if(outputs_.begin(), outputs_.end(),
                                  [&](const Output& candidate) { return candidate.named == output; });
  assert(found != outputs_.end());
  return found->staged;
}

Status OutputFiles::Commit() {
  for (const Output& output : outputs_) {
    std::error_code error;
    if (output.staged != output.target) {
      fs::rename(output.staged, output.target, error);
    }
    if (error) {
      for (const Output& renamed : outputs_) {
        std::error_code ignored;
        if (renamed.staged != renamed.target) {
          fs::remove(renamed.target, ignored);
        }
      }
      return Fail(ErrorCode::kIo, "{}: cannot be written: {}", output.named.string(), error.message());
    }
  }
  return {};
}

}  // namespace forgescan
