// Memory for arrays of tens of megabytes that are read or written from end to end.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace forgescan {

// Reserves like std::vector::reserve, and asks for pages of 2 MB before anything new is written: touching 4 kB
// pages for the first time takes longer than most of what is done with them, and looking them up is felt
// every time. Advice only: where it is not taken nothing else changes.
template <typename T>
void ReserveHuge(std::size_t size, std::vector<T>& values) {
  constexpr std::uintptr_t kHugePage = std::uintptr_t{2} << 20;
  if (size <= values.capacity()) {
    return;
  }
  values.reserve(size);
  const auto begin = reinterpret_cast<std::uintptr_t>(values.data());
  const std::uintptr_t first = (begin + kHugePage - 1) / kHugePage * kHugePage;
  const std::uintptr_t last = (begin + values.capacity() * sizeof(T)) / kHugePage * kHugePage;
  if (first < last) {
    madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
  }
}

}  // namespace forgescan
