#include "tests/fuzz/readers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace forgescan::fuzz {
namespace {

constexpr std::size_t kLongestSentence = 4004;  // as Quotable() in result.h leaves it

class Folder {
 public:
  Folder()
      : path_(std::filesystem::temp_directory_path() / fmt::format("forgescan_fuzz_{}", getpid())),
        owner_(getpid()) {
    std::filesystem::create_directories(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;  // a folder that stays is no failure of the reader
    if (getpid() == owner_) std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  pid_t owner_;
};

}  // namespace

std::string SentenceProblem(const Error& error, std::string_view name) {
  const std::string& text = error.message;
  if (text.empty()) return "the error has no sentence";
  if (text.size() > kLongestSentence) return fmt::format("the error has {} characters", text.size());
  if (text.find(name) == std::string::npos) return fmt::format("the error does not name {}: {}", name, text);
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' ' && c != '\n'; };
  if (std::any_of(text.begin(), text.end(), is_control)) {
    return fmt::format("the error has control characters: {}", text);
  }
  return {};
}

const std::filesystem::path& ScratchFolder() {
  static const Folder folder;
  return folder.path();
}

std::string ScratchFile(std::string_view name, std::string_view bytes) {
  const std::filesystem::path path = ScratchFolder() / name;
  std::filesystem::remove(path);  // ext4 writes a file to disk that is cut to nothing and written again
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path.string();
}

std::string RepositoryFile(const std::string& path) {
  std::ifstream file(std::filesystem::path(FORGESCAN_SOURCE_DIR) / path, std::ios::binary);
  if (!file) {
    std::fprintf(stderr, "%s is not in the repository\n", path.c_str());
    std::exit(1);
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace forgescan::fuzz
