#include "tests/fuzz/counted_memory.h"

#include <cstdlib>
#include <new>

namespace forgescan::fuzz {

std::size_t& LargestRequest() {
  static std::size_t bytes = 0;
  return bytes;
}

}  // namespace forgescan::fuzz

#ifndef FORGESCAN_SANITIZED
void* operator new(std::size_t size) {
  std::size_t& largest = forgescan::fuzz::LargestRequest();
  largest = size > largest ? size : largest;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif
