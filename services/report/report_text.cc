#include "services/report/report_text.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

namespace forgescan {
namespace {

constexpr std::string_view kDash = "\u2013";
constexpr std::string_view kMinus = "\u2212";
constexpr std::string_view kThinSpace = "\u202f";

struct CalendarTime {
  std::chrono::year_month_day day;
  std::chrono::hh_mm_ss<std::chrono::seconds> time;
};

CalendarTime Calendar(std::int64_t utime) {
  const std::chrono::sys_time<std::chrono::microseconds> at{std::chrono::microseconds(utime)};
  const auto day = std::chrono::floor<std::chrono::days>(at);
  return {day, std::chrono::hh_mm_ss(std::chrono::floor<std::chrono::seconds>(at - day))};
}

std::string CalendarText(std::int64_t utime,
                         fmt::format_string<int&, unsigned&, unsigned&, long&, long&, long&> form) {
  const CalendarTime at = Calendar(utime);
  int year = static_cast<int>(at.day.year());
  auto month = static_cast<unsigned>(at.day.month());
  auto day = static_cast<unsigned>(at.day.day());
  long hours = at.time.hours().count();
  long minutes = at.time.minutes().count();
  long seconds = at.time.seconds().count();
  return fmt::format(form, year, month, day, hours, minutes, seconds);
}

}  // namespace

std::string UtcText(std::int64_t utime) {
  return utime <= 0 ? "" : CalendarText(utime, "{}-{:02}-{:02} {:02}:{:02}:{:02} UTC");
}

std::string UtcFileText(std::int64_t utime) {
  return CalendarText(utime, "{:04}{:02}{:02}T{:02}{:02}{:02}Z");
}

std::string EscapeHtml(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string NumberText(double value, int decimals) {
  if (!std::isfinite(value)) {
    return std::string(kDash);
  }
  const std::string digits = fmt::format("{:.{}f}", std::abs(value), decimals);
  const bool zero = digits.find_first_not_of("0.") == std::string::npos;
  return value < 0.0 && !zero ? std::string(kMinus) + digits : digits;
}

std::string SignedText(double value, int decimals) {
  const std::string text = NumberText(value, decimals);
  return value > 0.0 && std::isfinite(value) && text.find_first_not_of("0.") != std::string::npos ? "+" + text
                                                                                                  : text;
}

std::string CountText(std::int64_t value) {
  const std::string digits = fmt::format("{}", value);
  std::string grouped;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    const std::size_t left = digits.size() - i;
    if (i > 0 && left % 3 == 0 && digits[i - 1] != '-') {
      grouped += kThinSpace;
    }
    grouped += digits[i];
  }
  return grouped;
}

std::string CountText(const std::optional<std::int64_t>& value) {
  return value.has_value() ? CountText(*value) : std::string(kDash);
}

}  // namespace forgescan
