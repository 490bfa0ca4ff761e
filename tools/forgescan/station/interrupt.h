// Ctrl-C and SIGTERM as a question the tool asks between two steps.
#pragma once

#include <csignal>

namespace forgescan {

class Interrupt {
 public:
  // Blocks both signals for this process and the threads it starts from now on.
  Interrupt() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    sigprocmask(SIG_BLOCK, &signals_, nullptr);
  }
  bool Requested() const {
    sigset_t pending;
    sigpending(&pending);
    return sigismember(&pending, SIGINT) == 1 || sigismember(&pending, SIGTERM) == 1;
  }

 private:
  sigset_t signals_;
};

}  // namespace forgescan
