// A parser by recursive descent for LCM's language, as far as lcm_type.h takes it.
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>

#include "services/common/log/lcm_type.h"

namespace forgescan {
namespace {

constexpr std::array<std::pair<std::string_view, LcmPrimitive>, 9> kPrimitives{
    {{"int8_t", LcmPrimitive::kInt8},
     {"int16_t", LcmPrimitive::kInt16},
     {"int32_t", LcmPrimitive::kInt32},
     {"int64_t", LcmPrimitive::kInt64},
     {"byte", LcmPrimitive::kByte},
     {"float", LcmPrimitive::kFloat},
     {"double", LcmPrimitive::kDouble},
     {"string", LcmPrimitive::kString},
     {"boolean", LcmPrimitive::kBoolean}}};

std::optional<LcmPrimitive> PrimitiveOf(std::string_view type) {
  const auto* found = std::find_if(kPrimitives.begin(), kPrimitives.end(),
                                   [type](const auto& entry) { return entry.first == type; });
  return found == kPrimitives.end() ? std::nullopt : std::optional(found->second);
}

bool IsCounter(const LcmField& field) {
  return field.dimensions.empty() && field.primitive && *field.primitive <= LcmPrimitive::kInt64;
}

bool IsName(std::string_view token) {
  return !token.empty() && (std::isalpha(static_cast<unsigned char>(token[0])) != 0 || token[0] == '_') &&
         std::all_of(token.begin(), token.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

// A name with packages before it: a.b.name_t.
bool IsTypeName(std::string_view token) {
  for (std::size_t dot; (dot = token.find('.')) != std::string_view::npos; token.remove_prefix(dot + 1)) {
    if (!IsName(token.substr(0, dot))) {
      return false;
    }
  }
  return IsName(token);
}

// Cuts a text into words and signs; comments and white space lie between them.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : rest_(text) { Next(); }

  // Empty at the end.
  std::string_view Peek() const { return token_; }
  std::string_view Take() {
    const std::string_view taken = token_;
    taken_line_ = line_;
    Next();
    return taken;
  }
  // Takes the sign if it comes next.
  bool Try(std::string_view sign) { return token_ == sign && (Take(), true); }
  Status Require(std::string_view sign) {
    const std::string_view token = Take();
    return token == sign ? Status() : Wrong(token, sign);
  }
  Error Wrong(std::string_view token, std::string_view expected) const {
    return Fail(ErrorCode::kFormat, "line {}: \"{}\" stands where {} should", taken_line_,
                token.empty() ? "the end of the text" : token.substr(0, 40), expected);
  }

 private:
  static constexpr std::string_view kSigns = "{}[];,=";

  void Skip(std::size_t count) {
    const std::string_view skipped = rest_.substr(0, count);
    line_ += std::count(skipped.begin(), skipped.end(), '\n');
    rest_.remove_prefix(skipped.size());
  }
  void SkipBetween() {
    while (!rest_.empty()) {
      if (std::isspace(static_cast<unsigned char>(rest_[0])) != 0) {
        Skip(1);
      } else if (rest_.starts_with("//")) {
        Skip(std::min(rest_.find('\n'), rest_.size()));
      } else if (rest_.starts_with("/*")) {
        const std::size_t end = rest_.find("*/", 2);
        Skip(end == std::string_view::npos ? rest_.size() : end + 2);
      } else {
        return;
      }
    }
  }
  void Next() {
    SkipBetween();
    std::size_t size = rest_.empty() ? 0 : 1;
    if (size == 1 && kSigns.find(rest_[0]) == std::string_view::npos) {
      while (size < rest_.size() && kSigns.find(rest_[size]) == std::string_view::npos &&
             std::isspace(static_cast<unsigned char>(rest_[size])) == 0 && rest_[size] != '/') {
        ++size;
      }
    }
    token_ = rest_.substr(0, size);
    rest_.remove_prefix(size);
  }

  std::string_view rest_;
  std::string_view token_;
  std::ptrdiff_t line_ = 1, taken_line_ = 1;
};

class Parser {
 public:
  explicit Parser(std::string_view text) : tokens_(text) {}

  Result<std::vector<LcmStruct>> Run() {
    std::vector<LcmStruct> structs;
    while (!tokens_.Peek().empty()) {
      const std::string_view word = tokens_.Take();
      if (word == "package") {
        ASSIGN_OR_RETURN(package_, TypeName());
        RETURN_IF_ERROR(tokens_.Require(";"));
      } else if (word == "struct") {
        if (structs.size() >= kMaxLcmStructs) {
          return Fail(ErrorCode::kFormat, "the text defines more than {} structs", kMaxLcmStructs);
        }
        ASSIGN_OR_RETURN(structs.emplace_back(), Struct());
      } else {
        return tokens_.Wrong(word, "\"struct\" or \"package\"");
      }
    }
    return structs;
  }

 private:
  Result<std::string> Name() {
    const std::string_view token = tokens_.Take();
    return IsName(token) ? Result<std::string>(std::string(token)) : tokens_.Wrong(token, "a name");
  }
  Result<std::string> TypeName() {
    const std::string_view token = tokens_.Take();
    return IsTypeName(token) ? Result<std::string>(std::string(token))
                             : tokens_.Wrong(token, "a type's name");
  }
  std::string WithPackage(const std::string& type) const {
    return package_.empty() || type.find('.') != std::string::npos ? type : package_ + "." + type;
  }
  // A constant, or the field that comes next in the struct that is being read.
  Status AddMember(const LcmStruct& type, const std::string& name, std::optional<std::size_t> field) {
    if (members_.size() >= kMaxLcmMembers) {
      return Fail(ErrorCode::kFormat, "{} has more than {} members", type.name, kMaxLcmMembers);
    }
    return members_.try_emplace(name, field).second
               ? Status()
               : Status(Fail(ErrorCode::kFormat, "{} has two members {}", type.name, name));
  }

  Result<LcmStruct> Struct() {
    LcmStruct type;
    ASSIGN_OR_RETURN(const std::string name, Name());
    type.name = WithPackage(name);
    members_.clear();
    RETURN_IF_ERROR(tokens_.Require("{"));
    while (!tokens_.Try("}")) {
      RETURN_IF_ERROR(tokens_.Try("const") ? Constants(type) : Fields(type));
    }
    return type;
  }

  // int8_t A = 1, B = 2;
  Status Constants(LcmStruct& type) {
    ASSIGN_OR_RETURN(const std::string constant_type, Name());
    do {
      LcmConstant constant{"", constant_type, ""};
      ASSIGN_OR_RETURN(constant.name, Name());
      RETURN_IF_ERROR(AddMember(type, constant.name, std::nullopt));
      RETURN_IF_ERROR(tokens_.Require("="));
      constant.value = tokens_.Take();
      if (constant.value.empty() ||
          std::string_view("{}[];,=").find(constant.value[0]) != std::string::npos) {
        return tokens_.Wrong(constant.value, "the value of a constant");
      }
      type.constants.push_back(std::move(constant));
    } while (tokens_.Try(","));
    return tokens_.Require(";");
  }

  // double a, b[3], c[n][4];
  Status Fields(LcmStruct& type) {
    ASSIGN_OR_RETURN(const std::string word, TypeName());
    const std::optional<LcmPrimitive> primitive = PrimitiveOf(word);
    do {
      LcmField field{"", primitive ? word : WithPackage(word), primitive, {}};
      ASSIGN_OR_RETURN(field.name, Name());
      while (tokens_.Try("[")) {
        if (field.dimensions.size() >= kMaxLcmDimensions) {
          return Fail(ErrorCode::kFormat, "{}.{} has more than {} dimensions", type.name, field.name,
                      kMaxLcmDimensions);
        }
        ASSIGN_OR_RETURN(field.dimensions.emplace_back(), Dimension(type));
        RETURN_IF_ERROR(tokens_.Require("]"));
      }
      RETURN_IF_ERROR(AddMember(type, field.name, type.fields.size()));
      type.fields.push_back(std::move(field));
    } while (tokens_.Try(","));
    return tokens_.Require(";");
  }

  // The number or the field between brackets.
  Result<LcmDimension> Dimension(const LcmStruct& type) {
    const std::string_view token = tokens_.Take();
    LcmDimension dimension{std::string(token), 0, 0};
    if (IsName(token)) {
      const auto counter = members_.find(token);
      if (counter == members_.end() || !counter->second || !IsCounter(type.fields[*counter->second])) {
        return tokens_.Wrong(token, "a number or an earlier integer field");
      }
      dimension.counter = *counter->second;
      return dimension;
    }
    // As C reads numbers: 0x for hexadecimal, 0 for octal.
    const bool is_hex = token.starts_with("0x") || token.starts_with("0X");
    const std::string_view digits = token.substr(is_hex ? 2 : 0);
    const int base = is_hex ? 16 : token.starts_with("0") ? 8 : 10;
    std::int32_t size = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), size, base);
    if (error != std::errc() || end != digits.data() + digits.size() || size <= 0) {
      return tokens_.Wrong(token, "a number from 1 to 2147483647 or an earlier integer field");
    }
    dimension.fixed = size;
    return dimension;
  }

  Tokens tokens_;
  std::string package_;
  // Of the struct that is being read: the index of a field, nothing for a constant.
  std::map<std::string, std::optional<std::size_t>, std::less<>> members_;
};

}  // namespace

Result<std::vector<LcmStruct>> ParseLcmDefinitions(std::string_view text) { return Parser(text).Run(); }

}  // namespace forgescan
