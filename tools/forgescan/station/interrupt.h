// Ctrl-C, SIGTERM and a terminal that goes away (SIGHUP) as a question the tool asks between two steps.
#pragma once

#include <csignal>

namespace forgescan {

class Interrupt {
 public:
  // Blocks these signals for this process and the threads it starts from now on.
  Interrupt() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGHUP);
    sigprocmask(SIG_BLOCK, &signals_, nullptr);
  }
  bool Requested() const {
    sigset_t pending;
    sigpending(&pending);
    return sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1 ||
           sigismember(&pending, SIGHUP) == 1;
  }

 private:
  sigset_t signals_;
};

}  // namespace forgescan
