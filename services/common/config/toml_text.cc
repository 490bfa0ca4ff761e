#include "services/common/config/toml_text.h"

#include <algorithm>
#include <string>

namespace forgescan {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool IsBeyondAscii(char c) { return static_cast<unsigned char>(c) >= 0x80; }

// Whether a text may begin at the quote there: within a number or a name it does not, and the parser goes on
// to the next blank. What is glued to the quote must be nothing, brackets, or a key with its sign.
bool BeginsText(std::string_view text, std::size_t at) {
  constexpr std::string_view kBlanks = " \t\r\n,", kBrackets = "[{";
  constexpr std::size_t kLongestKey = 200;
  const std::size_t first = at - std::min(at, kLongestKey);
  std::string_view glued = text.substr(first, at - first);
  glued.remove_prefix(glued.find_last_of(kBlanks) + 1);  // all of it stays without one
  const std::size_t sign = glued.find('=');
  if (sign != std::string_view::npos) {
    const std::string_view before = text.substr(0, at - glued.size());
    const std::size_t last = before.find_last_not_of(" \t\r");
    const bool is_key = sign == 0 || glued[0] == '{' || last == std::string_view::npos ||
                        std::string_view("\n,{").find(before[last]) != std::string_view::npos;
    if (!is_key) return false;
    glued.remove_prefix(sign + 1);
  }
  return glued.find_first_not_of(kBrackets) == std::string_view::npos;
}

// Where the text in quotes that begins there ends; at the character itself, if one beyond ASCII is escaped. A
// text that its line leaves open ends there: the parser refuses it.
std::size_t EndOfText(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  const std::string three(3, quote);
  const bool is_long = text.substr(begin).starts_with(three);
  const std::string_view closing = std::string_view(three).substr(0, is_long ? 3 : 1);
  for (std::size_t at = begin + closing.size(); at < text.size(); ++at) {
    if (text.substr(at).starts_with(closing)) {
      at += closing.size();
      // Up to two quotes more belong to a long text.
      for (int more = 0; is_long && more < 2 && at < text.size() && text[at] == quote; ++more) ++at;
      return at;
    }
    if (!is_long && text[at] == '\n') return at;
    if (quote == '\'' || text[at] != '\\') continue;
    // A backslash at the end of a line takes the blanks of the next one.
    at = std::min(text.find_first_not_of(" \t\r\n", at + 1), text.size());
    if (at < text.size() && IsBeyondAscii(text[at])) return at;
  }
  return text.size();
}

}  // namespace

Status CheckTomlText(std::string_view text, std::string_view name) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::size_t at = 0;
  while (at < text.size()) {
    if (IsBeyondAscii(text[at])) {
      return Fail(ErrorCode::kFormat, "{}: line {}: a character beyond ASCII outside a text or comment", name,
                  1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
    }
    if (text[at] == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if ((text[at] == '"' || text[at] == '\'') && BeginsText(text, at)) {
      at = EndOfText(text, at);
    } else {
      ++at;
    }
  }
  return {};
}

}  // namespace forgescan
