// Damaged copies of good files: what disks, wires, editors and bad luck do to them, and what somebody would
// do on purpose.
#pragma once

#include <random>
#include <string>

namespace forgescan::fuzz {

// A copy with one to four changes: bits, bytes and blocks flipped, lost, doubled or put elsewhere; the end
// cut off; numbers, in text and in binary of either byte order, made extreme or no number; lines lost,
// doubled, very long; brackets nested deeply; CRLF, a byte order mark, zero bytes. Equal seeds of `random`
// give equal copies. The copy is at most kMostAdded bytes longer than `bytes`.
inline constexpr std::size_t kMostAdded = 800'000;
std::string Mutate(std::string bytes, std::mt19937_64& random);

}  // namespace forgescan::fuzz
