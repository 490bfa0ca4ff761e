#include "tests/line/prepared_station.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <regex>
#include <sstream>

namespace forgescan::testing {

namespace fs = std::filesystem;

std::string ReadAll(const fs::path& path) {
  std::ifstream stream(path);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void WriteSmallStation(const fs::path& folder, const std::map<std::string, std::string>& changes) {
  const fs::path stations = fs::path(FORGESCAN_SOURCE_DIR) / "stations";
  fs::create_directories(folder / "station");
  std::string text = ReadAll(stations / "virtual-small/station.toml");
  for (const auto& [from, to] : changes) {
    ASSERT_TRUE(std::regex_search(text, std::regex(from))) << from << " is not in station.toml";
    text = std::regex_replace(text, std::regex(from), to);
  }
  std::ofstream(folder / "station/station.toml") << text;
  fs::copy_file(stations / "virtual/cell.toml", folder / "station/cell.toml",
                fs::copy_options::overwrite_existing);
}

Background::Background(const std::vector<std::string>& arguments, const fs::path& output) : output_(output) {
  std::vector<std::string> words = arguments;
  words[0] = std::string(FORGESCAN_BIN_DIR) + "/" + words[0];
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  const int file = open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(file);
}

Background::~Background() {
  if (running()) {
    Signal(SIGTERM);
    if (Wait(60) < 0 && running()) {
      Signal(SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
}

bool Background::running() {
  int status = 0;
  if (pid_ > 0 && waitpid(pid_, &status, WNOHANG) == pid_) {
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    pid_ = 0;
  }
  return pid_ > 0;
}

void Background::Signal(int signal) const {
  if (pid_ > 0) {
    kill(pid_, signal);
  }
}

int Background::Wait(int patience_s) {
  if (running()) {
    const int fd = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
    pollfd ended{fd, POLLIN, 0};
    poll(&ended, 1, patience_s * 1000);
    close(fd);
  }
  return running() ? -1 : exit_code_;
}

pid_t PidOfService(const fs::path& folder, const std::string& service) {
  std::istringstream lines(ReadAll(folder / "station.pid"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    pid_t pid = 0;
    if (words >> name >> pid && name == service) {
      return pid;
    }
  }
  return 0;
}

}  // namespace forgescan::testing
