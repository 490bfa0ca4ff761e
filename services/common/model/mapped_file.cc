#include "services/common/model/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace forgescan {

Result<std::shared_ptr<const MappedFile>> MappedFile::Open(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return Fail(ErrorCode::kNotFound, "{}: no such file, or not readable", path.string());
  struct stat status {};
  const bool plain = ::fstat(file, &status) == 0 && S_ISREG(status.st_mode);
  const auto size = static_cast<std::size_t>(status.st_size);
  void* memory = plain && size > 0 ? ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file, 0) : MAP_FAILED;
  const int error = errno;
  ::close(file);
  if (!plain) return Fail(ErrorCode::kIo, "{}: not a plain file", path.string());
  if (size == 0) return Fail(ErrorCode::kFormat, "{}: the file is empty", path.string());
  if (memory == MAP_FAILED) {
    return Fail(ErrorCode::kIo, "{}: cannot be mapped into memory: {}", path.string(), std::strerror(error));
  }
  return std::shared_ptr<const MappedFile>(new MappedFile({static_cast<const char*>(memory), size}));
}

MappedFile::~MappedFile() { ::munmap(const_cast<char*>(bytes_.data()), bytes_.size()); }

}  // namespace forgescan
