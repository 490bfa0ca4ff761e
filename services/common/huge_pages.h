// Memory for arrays of tens of megabytes that are read or written from end to end.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace forgescan {

// Asks for pages of 2 MB, before anything is written: touching 4 kB pages for the first time takes longer
// than most of what is done with them, and looking them up is felt every time. Advice only: where it is not
// taken nothing else changes.
inline void AdviseHuge(const void* memory, std::size_t bytes) {
  constexpr std::uintptr_t kHugePage = std::uintptr_t{2} << 20;
  const auto begin = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t first = (begin + kHugePage - 1) / kHugePage * kHugePage;
  const std::uintptr_t last = (begin + bytes) / kHugePage * kHugePage;
  if (first < last) {
    madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
  }
}

// Like std::vector::reserve, in such pages.
template <typename T>
void ReserveHuge(std::size_t size, std::vector<T>& values) {
  if (size > values.capacity()) {
    values.reserve(size);
    AdviseHuge(values.data(), values.capacity() * sizeof(T));
  }
}

}  // namespace forgescan
