// What a program asks of operator new: a reader that believes a count is found by it.
#pragma once

#include <cstddef>

namespace forgescan::fuzz {

// The most bytes asked for at once since it was set to 0. Stays 0 under sanitizers, which count themselves.
// One thread at a time.
std::size_t& LargestRequest();

}  // namespace forgescan::fuzz
