// Byte by byte work on rows of a mask, for each kind of vector instructions.
#pragma once

#include <cstdint>
#include <span>

#include "services/common/simd_path.h"

namespace forgescan {

class MaskKernel {
 public:
  explicit MaskKernel(SimdPath path);

  // out[x] = the bits of in[x] to in[x + reach], joined by or; in has reach bytes more than out.
  void Widen(std::span<const std::uint8_t> in, int reach, std::span<std::uint8_t> out) const {
    widen_(in, reach, out);
  }
  // to[x] = the bits of all rows, at least one, joined by or.
  void Join(std::span<const std::uint8_t* const> rows, std::span<std::uint8_t> to) const { join_(rows, to); }
  // cause[x] becomes border where it is 0 and near[x] is not.
  void Mark(std::span<const std::uint8_t> near, std::uint8_t border, std::span<std::uint8_t> cause) const {
    mark_(near, border, cause);
  }

 private:
  void (*widen_)(std::span<const std::uint8_t>, int, std::span<std::uint8_t>);
  void (*join_)(std::span<const std::uint8_t* const>, std::span<std::uint8_t>);
  void (*mark_)(std::span<const std::uint8_t>, std::uint8_t, std::span<std::uint8_t>);
};

}  // namespace forgescan
