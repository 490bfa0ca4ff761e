#include "services/common/new_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace forgescan {

std::string StagedEnding() { return fmt::format(".{}.tmp", getpid()); }

// Some file systems cannot refuse and rename in one step; there a look before has to do.
Status RenameToNew(const std::filesystem::path& from, const std::filesystem::path& to) {
  int outcome = renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE);
  if (outcome != 0 && (errno == EINVAL || errno == ENOSYS)) {
    if (access(to.c_str(), F_OK) == 0) {
      errno = EEXIST;
    } else {
      outcome = rename(from.c_str(), to.c_str());
    }
  }
  if (outcome != 0) {
    return Fail(ErrorCode::kIo, "{} cannot be renamed to {} ({})", from.string(), to.string(),
                std::strerror(errno));
  }
  return {};
}

}  // namespace forgescan
