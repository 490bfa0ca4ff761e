// Numbers, times and text as a report prints them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace forgescan {

// "2026-03-01 08:15:27 UTC"; empty for a time that is not known (<= 0).
std::string UtcText(std::int64_t utime);
// "20260301T081527Z", for names of folders.
std::string UtcFileText(std::int64_t utime);

// Text that is safe between tags and in quoted attributes.
std::string EscapeHtml(std::string_view text);

// With so many decimals and a true minus sign; "–" for NaN. The signed form writes + too.
std::string NumberText(double value, int decimals);
std::string SignedText(double value, int decimals);
// 23 612 448: groups of three, thin spaces that do not break; the second form writes "–" for what is not
// known.
std::string CountText(std::int64_t value);
std::string CountText(const std::optional<std::int64_t>& value);

}  // namespace forgescan
