#include "services/common/config/toml_text.h"

#include <algorithm>
#include <string>

namespace forgescan {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

bool IsBeyondAscii(char c) { return static_cast<unsigned char>(c) >= 0x80; }

// Where in a document we are, outside its texts: a quote within a number or a name begins no text, and the
// parser goes on to the next blank.
class Position {
 public:
  bool IsBeforeText() const {
    constexpr std::string_view kBeforeKey = " \t\r\n[{,.";
    return part_ == Part::kValue || (part_ == Part::kKey && kBeforeKey.find(previous_) != kBeforeKey.npos);
  }

  void PassText() {
    if (part_ == Part::kValue) part_ = Part::kAfter;
    previous_ = '"';
  }

  void Pass(char c) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const char open = open_.empty() ? '\0' : open_.back();
    if (c == '\n' && open_.empty()) {
      part_ = Part::kKey;
    } else if (part_ == Part::kKey && c == '=') {
      part_ = Part::kValue;
    } else if (part_ == Part::kValue && (c == '[' || c == '{')) {
      open_.push_back(c);
      part_ = BeginOf(c);
    } else if ((open == '[' && c == ']') || (open == '{' && c == '}')) {
      open_.pop_back();
      part_ = Part::kAfter;
    } else if (!open_.empty() && c == ',') {
      part_ = BeginOf(open);
    } else if (part_ == Part::kValue && kBlanks.find(c) == kBlanks.npos) {
      part_ = Part::kAfter;
    }
    previous_ = c;
  }

 private:
  enum class Part { kKey, kValue, kAfter };  // a key or a table's name, before a value, in or behind it

  static Part BeginOf(char bracket) { return bracket == '[' ? Part::kValue : Part::kKey; }

  Part part_ = Part::kKey;
  std::string open_;  // brackets of arrays and inline tables
  char previous_ = '\n';
};

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
    // A backslash at the end of a line takes the blanks of the next one, else one character.
    const std::size_t next = std::min(text.find_first_not_of(" \t\r\n", at + 1), text.size());
    if (next < text.size() && IsBeyondAscii(text[next])) return next;
    at = next > at + 1 ? next - 1 : next;
  }
  return text.size();
}

}  // namespace

Status CheckTomlText(std::string_view text, std::string_view name) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  Position position;
  std::size_t at = 0;
  while (at < text.size()) {
    if (IsBeyondAscii(text[at])) {
      return Fail(ErrorCode::kFormat, "{}: line {}: a character beyond ASCII outside a text or comment", name,
                  1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
    }
    if (text[at] == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if ((text[at] == '"' || text[at] == '\'') && position.IsBeforeText()) {
      at = EndOfText(text, at);
      position.PassText();
    } else {
      position.Pass(text[at++]);
    }
  }
  return {};
}

}  // namespace forgescan
