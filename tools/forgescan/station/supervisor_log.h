// What the supervisor did, for whoever asks afterwards: LOG_FOLDER/supervisor.log, one line an event.
#pragma once

#include <string>

#include "services/common/result.h"

namespace forgescan {

// What of it also goes to standard output.
enum class Echo { kNothing, kTroubles, kAll };

class SupervisorLog {
 public:
  // Appends. Errors: kIo.
  static Result<SupervisorLog> Open(const std::string& log_folder, Echo echo);

  // "2026-03-01 08:15:27.123 <subject>: <text>", in UTC. A line that cannot be written goes to standard
  // error, and the next one that can says how many are missing.
  void Write(const std::string& subject, const std::string& text, bool trouble = false);

 private:
  SupervisorLog(std::string path, Echo echo) : path_(std::move(path)), echo_(echo) {}
  bool Append(const std::string& text) const;

  std::string path_;
  Echo echo_;
  int lost_ = 0;  // lines, since the last one that was written
};

}  // namespace forgescan
