// What the supervisor did, for whoever asks afterwards: LOG_FOLDER/supervisor.log, one line an event.
#pragma once

#include <fstream>
#include <string>

#include "services/common/result.h"

namespace forgescan {

// What of it also goes to standard output.
enum class Echo { kNothing, kTroubles, kAll };

class SupervisorLog {
 public:
  // Appends. Errors: kIo.
  static Result<SupervisorLog> Open(const std::string& log_folder, Echo echo);

  // "2026-03-01 08:15:27.123 <subject>: <text>", in UTC.
  void Write(const std::string& subject, const std::string& text, bool trouble = false);

 private:
  SupervisorLog(std::ofstream file, Echo echo) : file_(std::move(file)), echo_(echo) {}

  std::ofstream file_;
  Echo echo_;
};

}  // namespace forgescan
