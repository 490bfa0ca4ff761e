#include "services/common/config/toml_text.h"

#include <algorithm>
#include <string>

namespace forgescan {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool IsBeyondAscii(char c) { return static_cast<unsigned char>(c) >= 0x80; }

// Within a number or a name a quote begins no text: the parser goes on to the next blank.
bool BeginsText(std::string_view text, std::size_t at) {
  constexpr std::string_view kBefore = " \t\r\n=,[{.";
  return (text[at] == '"' || text[at] == '\'') &&
         (at == 0 || kBefore.find(text[at - 1]) != std::string_view::npos);
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
    } else if (BeginsText(text, at)) {
      at = EndOfText(text, at);
    } else {
      ++at;
    }
  }
  return {};
}

}  // namespace forgescan
