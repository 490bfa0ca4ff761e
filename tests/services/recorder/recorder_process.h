// The recorder as a process, on a station made for a test, and a line that talks to it over the real bus.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "services/common/bus/lcm_bus.h"
#include "tests/services/recorder/line_script.h"
#include "tests/services/recorder/recordings.h"

namespace forgescan::testing {

class RecorderProcess : public ::testing::Test {
 protected:
  static constexpr std::int64_t kSecondUs = 1'000'000;

  void SetUp() override;
  void TearDown() override;
  // recv_buf_size of everybody's bus; 106496 is what a plain Debian allows.
  void MakeStation(int receive_buffer_bytes, const std::string& recorder_keys = "");
  // Until it says that it records. `file_bytes`: limit of the size of its files.
  void Start(rlim_t file_bytes = RLIM_INFINITY);
  void Signal(int signal) const;
  // Its exit code; 128 + the signal that ended it.
  int WaitForEnd();
  // Lifts or sets the limit of the size of its files.
  void LimitFiles(rlim_t bytes) const;

  // Processes of their own, to be started before the bus is opened; they end with the test.
  void StartBusyProcess();
  void StartFrameSubscriber(int receive_buffer_bytes);

  bool RunUntil(const std::function<bool()>& condition, double seconds);
  void Run(double seconds);
  std::int64_t Counter(const std::string& name) const;
  std::vector<Recording> Recordings() const { return ReadRecordings(base_ / "recordings"); }
  std::function<void()> Pause();

  std::filesystem::path base_;
  std::unique_ptr<LcmBus> bus_;
  std::unique_ptr<StreamHub> hub_;
  std::optional<fsmsg::service_state_t> service_;  // the recorder's last words
  std::optional<fsmsg::recorder_state_t> recorder_;
  pid_t pid_ = -1;
  std::vector<pid_t> others_;
};

}  // namespace forgescan::testing
