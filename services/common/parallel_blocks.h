// Work split into blocks of fixed size, so that a sum taken block by block is the same bytes for any number
// of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace forgescan {

// Number of blocks ForEachBlock makes of `count` items.
inline std::size_t BlockCount(std::size_t count, std::size_t block_size) {
  return (count + block_size - 1) / block_size;
}

// Calls work(block, begin, end) once for every block of [0, count), from up to `threads` threads (0 = as many
// as the host has). Which thread takes which block is left open; the blocks themselves depend on count and
// block_size only. `work` must not throw and must write to places of its own block only.
template <typename Work>
void ForEachBlock(std::size_t count, std::size_t block_size, unsigned threads, const Work& work) {
  const std::size_t blocks = BlockCount(count, block_size);
  std::atomic<std::size_t> next{0};
  const auto drain = [&] {
    for (std::size_t block = next++; block < blocks; block = next++) {
      work(block, block * block_size, std::min(count, (block + 1) * block_size));
    }
  };
  const std::size_t wanted = threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::jthread> helpers;
  for (std::size_t i = 1; i < std::min(wanted, blocks); ++i) {
    helpers.emplace_back(drain);
  }
  drain();
}

}  // namespace forgescan
