// Ctrl-C, SIGTERM and a terminal that goes away (SIGHUP) as a question the tool asks between two steps.
#pragma once

#include <csignal>
#include <initializer_list>

namespace forgescan {

class Interrupt {
 public:
  // Blocks these signals for this process and the threads it starts from now on. Whoever started it with
  // SIGHUP ignored (nohup) or SIGINT (a shell's job in the background) wants it to go on: these stay ignored,
  // since a blocked signal is pending even then. SIGTERM always counts, `station down` sends it.
  Interrupt() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    for (const int signal : {SIGINT, SIGHUP}) {
      struct sigaction now {};
      if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) {
        sigaddset(&signals_, signal);
      }
    }
    sigprocmask(SIG_BLOCK, &signals_, nullptr);
  }
  bool Requested() const {
    sigset_t pending;
    sigpending(&pending);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      if (sigismember(&signals_, signal) == 1 && sigismember(&pending, signal) == 1) {
        return true;
      }
    }
    return false;
  }

 private:
  sigset_t signals_;  // that count
};

}  // namespace forgescan
