// Every reader of the group on damaged files, the same ones each time. More of them: --runs=FACTOR; one run
// again: --first=NUMBER --runs=0.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/counted_memory.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/readers.h"

namespace {

constexpr unsigned kPatienceS = 60;             // for one file; the slowest takes a second
constexpr std::size_t kFreeBytes = 64'000'000;  // that a reader may ask for at once, whatever the file
constexpr std::size_t kBytesPerByte = 1000;     // and for each byte of the file: an ascii 0 becomes a point
constexpr rlim_t kProgramBytes = 4'000'000'000;

int runs_factor = 1, first_run = 0;
std::array<char, 200> current{};  // reader and run, for the last words of a signal

// Says which file it was, then ends as the signal would have.
extern "C" void SayWhich(int signal) {
  const ssize_t written = write(STDERR_FILENO, current.data(), std::string_view(current.data()).size());
  static_cast<void>(written);
  std::signal(signal, SIG_DFL);
  raise(signal);
}

void Watch() {
  static std::array<char, 1 << 16> stack;  // a reader may have used up its own
  const stack_t other{stack.data(), 0, stack.size()};
  sigaltstack(&other, nullptr);
  struct sigaction action {};
  action.sa_handler = SayWhich;
  action.sa_flags = SA_ONSTACK;
  for (const int signal : {SIGALRM, SIGABRT, SIGSEGV, SIGBUS, SIGFPE}) sigaction(signal, &action, nullptr);
}

}  // namespace

namespace forgescan::fuzz {
namespace {

const std::vector<Reader>& AllReaders() {
  static const std::vector<Reader> readers = Readers();
  return readers;
}

class MutatedFile : public ::testing::TestWithParam<std::size_t> {};

std::string BrokenPromise(const Reader& reader, const std::string& bytes) {
  LargestRequest() = 0;
  alarm(kPatienceS);
  const Outcome outcome = reader.read(bytes);
  alarm(0);
  if (LargestRequest() > kFreeBytes + kBytesPerByte * bytes.size()) {
    return fmt::format("asks for {} bytes at once for a file of {}", LargestRequest(), bytes.size());
  }
  return outcome.broken;
}

TEST_P(MutatedFile, IsTakenWholeOrRefusedInASentence) {
  const Reader& reader = AllReaders()[GetParam()];
  std::snprintf(current.data(), current.size(), "%s: a good file\n", reader.name.c_str());
  for (const std::string& seed : reader.seeds) {
    const Outcome outcome = reader.read(seed);
    EXPECT_TRUE(outcome.accepted) << reader.name << " refuses a good file";
    EXPECT_EQ(outcome.broken, "") << reader.name;
  }
  for (int run = first_run; run < first_run + std::max(1, reader.runs * runs_factor); ++run) {
    std::snprintf(current.data(), current.size(), "%s: --first=%d --runs=0\n", reader.name.c_str(), run);
    std::mt19937_64 random(static_cast<std::uint64_t>(run));
    const std::string& seed = reader.seeds[static_cast<std::size_t>(run) % reader.seeds.size()];
    const std::string broken = BrokenPromise(reader, Mutate(seed, random));
    ASSERT_EQ(broken, "") << current.data();
  }
  EXPECT_TRUE(reader.read(reader.seeds[0]).accepted) << reader.name << " refuses a good file afterwards";
}

INSTANTIATE_TEST_SUITE_P(Of, MutatedFile, ::testing::Range(std::size_t{0}, AllReaders().size()),
                         [](const auto& reader) { return AllReaders()[reader.param].name; });

}  // namespace
}  // namespace forgescan::fuzz

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument.starts_with("--runs=")) runs_factor = std::atoi(argument.substr(7).data());
    if (argument.starts_with("--first=")) first_run = std::atoi(argument.substr(8).data());
  }
#ifndef FORGESCAN_SANITIZED
  const rlimit most{kProgramBytes, kProgramBytes};  // a reader that asks malloc itself fails here
  setrlimit(RLIMIT_AS, &most);
#endif
  Watch();
  return RUN_ALL_TESTS();
}
