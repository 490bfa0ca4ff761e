#include "tools/forgescan/station/supervisor_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace forgescan {

Result<SupervisorLog> SupervisorLog::Open(const std::string& log_folder, Echo echo) {
  const std::filesystem::path path = std::filesystem::path(log_folder) / "supervisor.log";
  std::error_code problem;
  std::filesystem::create_directories(log_folder, problem);
  if (!std::ofstream(path, std::ios::app)) {
    return Fail(ErrorCode::kIo, "{}: cannot be written", path.string());
  }
  return SupervisorLog(path.string(), echo);
}

// Opened anew for every line: a stream that has failed once, on a full disk, keeps what it could not write.
bool SupervisorLog::Append(const std::string& text) const {
  std::ofstream file(path_, std::ios::app);
  file << text << std::flush;
  return file.good();
}

void SupervisorLog::Write(const std::string& subject, const std::string& text, bool trouble) {
  const auto now = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto ms = now.time_since_epoch().count() % 1000;
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const std::string when = fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03}", fmt::gmtime(seconds), ms);
  const std::string line = fmt::format("{} {}: {}\n", when, subject, text);
  // On a line of its own, whatever came of the last one.
  const std::string gap =
      lost_ == 0 ? "" : fmt::format("\n{} supervisor: {} lines could not be written here\n", when, lost_);
  lost_ = Append(gap + line) ? 0 : lost_ + 1;
  if (lost_ > 0) {
    std::fputs(line.c_str(), stderr);
  }
  if (echo_ == Echo::kAll || (echo_ == Echo::kTroubles && trouble)) {
    std::fputs(line.c_str(), stdout);
    std::fflush(stdout);
  }
}

}  // namespace forgescan
