// Splits the rows of an image among threads.
#pragma once

#include <algorithm>
#include <thread>
#include <vector>

namespace forgescan {

// Calls work(begin, end) for contiguous blocks of rows that together are [0, rows), one block a thread. The
// result is the same for any number of threads as long as what work writes for a row depends on that row
// alone.
template <typename Work>
void ParallelRows(int threads, int rows, const Work& work) {
  const int blocks = std::clamp(threads, 1, std::max(rows, 1));
  const auto edge = [rows, blocks](int block) {
    return static_cast<int>(static_cast<long>(rows) * block / blocks);
  };
  std::vector<std::jthread> others;
  for (int block = 1; block < blocks; ++block) {
    others.emplace_back([&work, edge, block] { work(edge(block), edge(block + 1)); });
  }
  work(0, edge(1));
}

}  // namespace forgescan
