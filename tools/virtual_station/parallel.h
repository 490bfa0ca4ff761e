// Independent pieces of work on several threads. The pieces write to places of their own, so the outcome does
// not depend on which thread did which.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace forgescan {

template <typename Work>
void ForEachIndex(int count, int threads, const Work& work) {
  std::atomic<int> next{0};
  const auto loop = [&] {
    for (int i = next++; i < count; i = next++) {
      work(i);
    }
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < threads; ++i) {
    helpers.emplace_back(loop);
  }
  loop();
}

}  // namespace forgescan
