// Commands as a user gives them to the shell.
#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace forgescan {

struct CommandOutput {
  int exit_code = -1;  // as the shell says it; -1 = it could not be started
  std::string text;    // standard output and error together, but for what the command redirects itself
};

inline CommandOutput RunCommand(const std::string& command) {
  CommandOutput output;
  FILE* pipe = popen(("exec 2>&1; " + command).c_str(), "r");
  if (pipe == nullptr) {
    return output;
  }
  std::array<char, 4096> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) {
    output.text += buffer.data();
  }
  const int status = pclose(pipe);
  output.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return output;
}

}  // namespace forgescan
