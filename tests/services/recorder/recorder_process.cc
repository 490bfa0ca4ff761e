#include "tests/services/recorder/recorder_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <fstream>

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;

constexpr double kStartPatience_s = 20;

std::string Url(int receive_buffer_bytes) {
  return fmt::format("udpm://239.255.76.67:7667?ttl=0&recv_buf_size={}", receive_buffer_bytes);
}

}  // namespace

void RecorderProcess::SetUp() {
  base_ = fs::path(::testing::TempDir()) / ("forgescan_recorder_process_" + std::to_string(getpid()));
  fs::remove_all(base_);
  fs::create_directories(base_ / "station");
}

void RecorderProcess::TearDown() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    WaitForEnd();
  }
  for (const pid_t other : others_) {
    kill(other, SIGKILL);
    waitpid(other, nullptr, 0);
  }
  hub_.reset();
  bus_.reset();
  if (!HasFailure()) {
    fs::remove_all(base_);
  }
}

void RecorderProcess::MakeStation(int receive_buffer_bytes, const std::string& recorder_keys) {
  const std::string url = Url(receive_buffer_bytes);
  std::ofstream(base_ / "station/station.toml")
      << "[station]\nname = \"test\"\nbus = \"" << url << "\"\ncan = \"udp:239.74.163.2:43113\"\n"
      << "calibration = \"stereo.yaml\"\npattern = \"pattern.toml\"\nviews = \"views.toml\"\n"
      << "model = \"a.bundle\"\nfeatures = \"features.toml\"\nresults = \"results\"\n"
      << "[recorder]\nfolder = \"../recordings\"\nmin_free_mb = 100\nsettle_s = 0.5\n"
      << recorder_keys;
  for (const char* name : {"stereo.yaml", "pattern.toml", "views.toml", "a.bundle", "features.toml"}) {
    std::ofstream(base_ / "station" / name) << name;
  }
  auto bus = LcmBus::Open(url);
  ASSERT_TRUE(bus.ok()) << bus.error().message;
  bus_ = *std::move(bus);
  SubscribeState<fsmsg::service_state_t>(*bus_, kServiceState,
                                         [this](const fsmsg::service_state_t& state) { service_ = state; });
  SubscribeState<fsmsg::recorder_state_t>(
      *bus_, kRecorderState, [this](const fsmsg::recorder_state_t& state) { recorder_ = state; });
}

void RecorderProcess::Start(rlim_t file_bytes) {
  recorder_.reset();
  service_.reset();
  const std::string program = fmt::format("{}/forgescan-recorder", FORGESCAN_BIN_DIR),
                    station = (base_ / "station").string(), log = (base_ / "recorder.log").string();
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit limit{file_bytes, RLIM_INFINITY};
    setrlimit(RLIMIT_FSIZE, &limit);
    const int fd = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    dup2(fd, STDOUT_FILENO);
    dup2(fd, STDERR_FILENO);
    execl(program.c_str(), program.c_str(), "--station", station.c_str(), nullptr);
    _exit(127);
  }
  ASSERT_GT(pid_, 0);
  ASSERT_TRUE(RunUntil(
      [this] {
        return recorder_.has_value() && recorder_->status == fsmsg::recorder_state_t::STATUS_RECORDING;
      },
      kStartPatience_s));
  if (hub_ == nullptr) {  // the recorder is there first, as in a station
    hub_ = std::make_unique<StreamHub>(*bus_, "line");
  }
}

void RecorderProcess::StartBusyProcess() {
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    std::atomic<unsigned> turns = 0;
    while (true) {
      ++turns;
    }
  }
  ASSERT_GT(pid, 0);
  others_.push_back(pid);
}

void RecorderProcess::StartFrameSubscriber(int receive_buffer_bytes) {
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const auto bus = LcmBus::Open(Url(receive_buffer_bytes));
    if (!bus.ok()) {
      _exit(1);
    }
    StreamHub hub(**bus, "subscriber");
    hub.SubscribeRaw(kFrameLeft.name, [](ByteView) {});
    hub.SubscribeRaw(kFrameRight.name, [](ByteView) {});
    _exit((*bus)->Run().ok() ? 0 : 1);
  }
  ASSERT_GT(pid, 0);
  others_.push_back(pid);
}

void RecorderProcess::Signal(int signal) const { ASSERT_EQ(kill(pid_, signal), 0); }

int RecorderProcess::WaitForEnd() {
  int status = 0;
  const bool ended = RunUntil([&] { return waitpid(pid_, &status, WNOHANG) == pid_; }, 60);
  EXPECT_TRUE(ended);
  pid_ = ended ? -1 : pid_;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

void RecorderProcess::LimitFiles(rlim_t bytes) const {
  const rlimit limit{bytes, RLIM_INFINITY};
  ASSERT_EQ(prlimit(pid_, RLIMIT_FSIZE, &limit, nullptr), 0);
}

bool RecorderProcess::RunUntil(const std::function<bool()>& condition, double seconds) {
  if (bus_ == nullptr) {
    return condition();
  }
  const std::int64_t until_us = bus_->NowUs() + static_cast<std::int64_t>(seconds * 1e6);
  while (!condition()) {
    if (bus_->NowUs() > until_us || !bus_->RunOnce(2'000).ok()) {
      return condition();
    }
  }
  return true;
}

void RecorderProcess::Run(double seconds) {
  RunUntil([] { return false; }, seconds);
}

std::int64_t RecorderProcess::Counter(const std::string& name) const {
  for (std::size_t i = 0; service_.has_value() && i < service_->counters.size(); ++i) {
    if (service_->counters[i].name == name) {
      return service_->counters[i].value;
    }
  }
  return 0;
}

std::function<void()> RecorderProcess::Pause() {
  return [this] { EXPECT_TRUE(bus_->RunOnce(1'000).ok()); };
}

}  // namespace forgescan::testing
