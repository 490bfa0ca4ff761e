// Which signals ask a command to stop. Each case has a process of its own, as dispositions belong to it.
#include "tools/forgescan/station/interrupt.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace forgescan {
namespace {

// Whether a process with `before` as the disposition of the signal takes it for a request.
bool IsRequest(int signal, void (*before)(int)) {
  const pid_t pid = fork();
  if (pid == 0) {
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    std::signal(signal, before);
    const Interrupt interrupt;
    if (interrupt.Requested()) {
      _exit(2);
    }
    raise(signal);
    _exit(interrupt.Requested() ? 1 : 0);
  }
  int status = -1;
  EXPECT_EQ(waitpid(pid, &status, 0), pid);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) < 2) << "status " << status;
  return WEXITSTATUS(status) == 1;
}

TEST(Interrupt, IsASignalThatWouldEndTheProcess) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    EXPECT_TRUE(IsRequest(signal, SIG_DFL)) << signal;
  }
}

TEST(Interrupt, IsNoneThatWasIgnoredFromTheStart) {
  EXPECT_FALSE(IsRequest(SIGHUP, SIG_IGN)) << "nohup";
  EXPECT_FALSE(IsRequest(SIGINT, SIG_IGN)) << "a job in the background";
}

TEST(Interrupt, StationDownReachesEverybody) { EXPECT_TRUE(IsRequest(SIGTERM, SIG_IGN)); }

}  // namespace
}  // namespace forgescan
