// How far work on a large file has come, on standard error.
#pragma once

#include <cstdint>
#include <cstdio>

namespace forgescan {

class Progress {
 public:
  explicit Progress(std::uint64_t total_bytes) : total_bytes_(total_bytes) {}

  // Says each tenth that is reached; says nothing of files that take no time.
  void At(std::uint64_t bytes) {
    const auto tenth = total_bytes_ < kWorthSaying ? 0 : static_cast<int>(bytes / (total_bytes_ / 10));
    if (tenth > tenth_) {
      tenth_ = tenth;
      std::fprintf(stderr, "%d %%\n", 10 * tenth);
    }
  }

 private:
  static constexpr std::uint64_t kWorthSaying = 500'000'000;
  std::uint64_t total_bytes_;
  int tenth_ = 0;
};

}  // namespace forgescan
