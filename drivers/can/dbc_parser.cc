#include <algorithm>
#include <cmath>
#include <regex>
#include <set>

#include "drivers/can/dbc.h"

namespace forgescan {
namespace {

constexpr std::size_t kLongestLine = 1000;  // std::regex takes a piece of the stack for every character

constexpr const char* kNumber = R"(([-+0-9.eE]+))";

class Parser {
 public:
  Status Line(const std::string& line);
  Result<DbcFile> Finish();

 private:
  Status Message(const std::smatch& match);
  Status Signal(const std::smatch& match);
  Status Values(const std::smatch& match);
  Status Comment(const std::smatch& match);
  DbcMessage* Find(std::uint32_t id);

  DbcFile file_;
};

Status CheckSignal(const DbcSignal& signal, const DbcMessage& message) {
  const bool inside =
      signal.bits >= 1 && signal.bits <= 32 && signal.start_bit + signal.bits <= 8 * message.length;
  if (!inside) {
    return Fail(ErrorCode::kFormat, "{}.{}: bits {}..{} leave the message, or more than 32 of them",
                message.name, signal.name, signal.start_bit, signal.start_bit + signal.bits - 1);
  }
  const double span = std::ldexp(1.0, signal.bits);
  const double low = signal.is_signed ? -span / 2 : 0;
  const double min_raw = std::round((signal.min - signal.offset) / signal.factor);
  const double max_raw = std::round((signal.max - signal.offset) / signal.factor);
  if (!(signal.factor > 0) || !(min_raw >= low) || !(max_raw < low + span) || !(signal.min < signal.max)) {
    return Fail(ErrorCode::kFormat, "{}.{}: range {}..{} does not fit {} bits of factor {}", message.name,
                signal.name, signal.min, signal.max, signal.bits, signal.factor);
  }
  for (const DbcSignal& other : message.signals) {
    const bool apart =
        signal.start_bit >= other.start_bit + other.bits || other.start_bit >= signal.start_bit + signal.bits;
    if (!apart || other.name == signal.name) {
      return Fail(ErrorCode::kFormat, "{}: {} and {} overlap or share a name", message.name, signal.name,
                  other.name);
    }
  }
  return {};
}

DbcMessage* Parser::Find(std::uint32_t id) {
  const auto found =
      std::find_if(file_.messages.begin(), file_.messages.end(), [&](const auto& m) { return m.id == id; });
  return found == file_.messages.end() ? nullptr : &*found;
}

Status Parser::Message(const std::smatch& match) {
  DbcMessage message;
  message.id = static_cast<std::uint32_t>(std::stoul(match[1]));
  message.name = match[2];
  message.length = std::stoi(match[3]);
  message.sender = match[4];
  const auto same_name = [&](const auto& m) { return m.name == message.name; };
  const bool known =
      std::any_of(file_.messages.begin(), file_.messages.end(), same_name) || Find(message.id) != nullptr;
  if (message.id > 0x7FF || message.length > 8 || known) {
    return Fail(ErrorCode::kFormat, "message {} {}: extended, longer than 8 bytes, or given twice",
                message.id, message.name);
  }
  file_.messages.push_back(std::move(message));
  return {};
}

Status Parser::Signal(const std::smatch& match) {
  if (file_.messages.empty()) {
    return Fail(ErrorCode::kFormat, "signal {} before any message", match[1].str());
  }
  DbcSignal signal;
  signal.name = match[1];
  signal.start_bit = std::stoi(match[2]);
  signal.bits = std::stoi(match[3]);
  signal.is_signed = match[4] == "-";
  signal.factor = std::stod(match[5]);
  signal.offset = std::stod(match[6]);
  signal.min = std::stod(match[7]);
  signal.max = std::stod(match[8]);
  signal.unit = match[9];
  RETURN_IF_ERROR(CheckSignal(signal, file_.messages.back()));
  file_.messages.back().signals.push_back(std::move(signal));
  return {};
}

Status Parser::Values(const std::smatch& match) {
  DbcMessage* message = Find(static_cast<std::uint32_t>(std::stoul(match[1])));
  if (message == nullptr) {
    return Fail(ErrorCode::kFormat, "VAL_ of unknown message {}", match[1].str());
  }
  const auto signal = std::find_if(message->signals.begin(), message->signals.end(),
                                   [&](const DbcSignal& s) { return s.name == match[2].str(); });
  if (signal == message->signals.end()) {
    return Fail(ErrorCode::kFormat, "VAL_ of unknown signal {}.{}", message->name, match[2].str());
  }
  static const std::regex kPair(R"re((\d+) "(\w+)")re");
  const std::string list = match[3];
  for (std::sregex_iterator it(list.begin(), list.end(), kPair), end; it != end; ++it) {
    const int value = std::stoi((*it)[1]);
    if (value < signal->min || value > signal->max) {
      return Fail(ErrorCode::kFormat, "VAL_ {}.{}: {} is out of range", message->name, signal->name, value);
    }
    signal->values.emplace_back(value, (*it)[2]);
  }
  return {};
}

Status Parser::Comment(const std::smatch& match) {
  DbcMessage* message = Find(static_cast<std::uint32_t>(std::stoul(match[1])));
  if (message == nullptr) {
    return Fail(ErrorCode::kFormat, "CM_ of unknown message {}", match[1].str());
  }
  message->comment = match[2];
  return {};
}

Status Parser::Line(const std::string& line) {
  static const std::regex kPassedOver(R"(\s*|(VERSION|NS_|BS_:|BU_:).*)");
  static const std::regex kMessage(R"(BO_ (\d{1,9}) (\w+): (\d) (\w+))");
  static const std::regex kSignal(std::string(R"re( SG_ (\w+) : (\d{1,2})\|(\d{1,2})@1([-+]) \()re") +
                                  kNumber + "," + kNumber + R"re(\) \[)re" + kNumber + R"re(\|)re" + kNumber +
                                  R"re(\] "([^"]*)" [\w,]+)re");
  static const std::regex kValues(R"re(VAL_ (\d{1,9}) (\w+)((?: \d{1,5} "\w+")+) ;)re");
  static const std::regex kComment(R"re(CM_ BO_ (\d{1,9}) "([^"]*)";)re");
  std::smatch match;
  if (std::regex_match(line, kPassedOver)) {
    return {};
  }
  if (std::regex_match(line, match, kMessage)) {
    return Message(match);
  }
  if (std::regex_match(line, match, kSignal)) {
    return Signal(match);
  }
  if (std::regex_match(line, match, kValues)) {
    return Values(match);
  }
  if (std::regex_match(line, match, kComment)) {
    return Comment(match);
  }
  return Fail(ErrorCode::kFormat, "'{}' is not a statement this reader knows", line);
}

Result<DbcFile> Parser::Finish() {
  if (file_.messages.empty()) {
    return Fail(ErrorCode::kFormat, "DBC text without any message");
  }
  return std::move(file_);
}

}  // namespace

Result<DbcFile> ParseDbc(std::string_view text) {
  Parser parser;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) {
      line.pop_back();
    }
    if (line.size() > kLongestLine) {
      return Fail(ErrorCode::kFormat, "DBC line {}: {} characters, allowed {}", number, line.size(),
                  kLongestLine);
    }
    Status status;
    try {  // std::sto* throw on numbers out of range
      status = parser.Line(line);
    } catch (const std::exception& bad_number) {
      status = Fail(ErrorCode::kFormat, "number out of range in '{}' ({})", line, bad_number.what());
    }
    if (!status.ok()) {
      return Fail(ErrorCode::kFormat, "DBC line {}: {}", number, status.error().message);
    }
  }
  return parser.Finish();
}

}  // namespace forgescan
