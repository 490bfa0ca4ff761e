#include "tools/forgescan/station/supervisor_log.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>

namespace forgescan {

Result<SupervisorLog> SupervisorLog::Open(const std::string& log_folder, Echo echo) {
  const std::filesystem::path path = std::filesystem::path(log_folder) / "supervisor.log";
  std::error_code problem;
  std::filesystem::create_directories(log_folder, problem);
  std::ofstream file(path, std::ios::app);
  if (!file) {
    return Fail(ErrorCode::kIo, "{}: cannot be written", path.string());
  }
  return SupervisorLog(std::move(file), echo);
}

void SupervisorLog::Write(const std::string& subject, const std::string& text, bool trouble) {
  const auto now = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  const auto ms = now.time_since_epoch().count() % 1000;
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const std::string line =
      fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} {}: {}\n", fmt::gmtime(seconds), ms, subject, text);
  file_ << line << std::flush;
  if (echo_ == Echo::kAll || (echo_ == Echo::kTroubles && trouble)) {
    std::fputs(line.c_str(), stdout);
    std::fflush(stdout);
  }
}

}  // namespace forgescan
