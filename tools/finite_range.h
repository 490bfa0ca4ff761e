// Numbers as options of a command.
#pragma once

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <string>

namespace forgescan {

// Refuses what is no number from `low` to `high`; CLI::Range lets NaN pass, since no comparison with it is
// true.
inline CLI::Validator FiniteRange(double low, double high) {
  const auto check = [low, high](std::string& text) {
    double value = 0;
    const bool inside = CLI::detail::lexical_cast(text, value) && value >= low && value <= high;
    return inside ? std::string() : fmt::format("{} is not a number from {} to {}", text, low, high);
  };
  return CLI::Validator(check, fmt::format("from {} to {}", low, high));
}

}  // namespace forgescan
