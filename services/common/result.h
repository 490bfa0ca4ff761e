// Result<T>: a value, or an Error that says in one sentence what went wrong, where and with which numbers.
//
// House rule: a function that can fail returns Result (or Status = Result<void>); a failure is never an
// identity matrix, a zero, an empty container or the last value. Exceptions stay inside main() and at the
// edges of third-party libraries.
#pragma once

#include <fmt/core.h>

#include <cassert>
#include <optional>
#include <source_location>
#include <string>
#include <utility>
#include <variant>

namespace forgescan {

enum class ErrorCode {
  kInvalidArgument,  // the caller's input is wrong (value, shape, file content)
  kNotFound,         // a file, key, device or entry does not exist
  kIo,               // the operating system refused to read, write or send
  kFormat,           // bytes that do not follow their format
  kTimeout,          // an answer did not come in time
  kUnavailable,      // a device, bus or service is not there (now)
  kProtocol,         // a peer broke its protocol
  kDegenerate,       // the data do not determine the result
  kNotConverged,     // an iteration did not reach its criterion
  kUntrusted,        // a result exists, but its own checks say not to use it
};

struct Error {
  ErrorCode code;
  std::string message;  // one sentence: what, where, allowed range
  std::source_location where;
};

// A format string that remembers where it was written.
template <typename... Args>
struct LocatedFormat {
  template <typename S>
  consteval LocatedFormat(const S& s, std::source_location at = std::source_location::current())
      : format(s), where(at) {}
  fmt::format_string<Args...> format;
  std::source_location where;
};

// Sentences quote what a file, a wire or a user says: that must not speak to the terminal nor fill it.
// Control characters but for the end of a line become '?'; of a text of more than 4000 bytes the rest is left
// out.
inline std::string Quotable(std::string text) {
  constexpr std::size_t kLongest = 4000;
  if (text.size() > kLongest) {
    text.replace(kLongest, std::string::npos, " ...");
  }
  for (char& c : text) {
    const bool is_control = (static_cast<unsigned char>(c) < ' ' && c != '\n') || c == '\x7F';
    c = is_control ? '?' : c;
  }
  return text;
}

// Builds an Error: return Fail(ErrorCode::kFormat, "{}: {} is not a PLY file", path, what);
template <typename... Args>
[[nodiscard]] Error Fail(ErrorCode code, LocatedFormat<std::type_identity_t<Args>...> text, Args&&... args) {
  return Error{code, Quotable(fmt::format(text.format, std::forward<Args>(args)...)), text.where};
}

template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return state_.index() == 0; }
  // Only if ok(): asking a failed result for its value is a bug of ours, not of the data.
  T& value() & { return assert(ok()), std::get<0>(state_); }
  const T& value() const& { return assert(ok()), std::get<0>(state_); }
  // By value: `for (auto& x : *Slices())` then keeps what it runs over.
  T value() && { return assert(ok()), std::get<0>(std::move(state_)); }
  const Error& error() const { return assert(!ok()), std::get<1>(state_); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return !error_.has_value(); }
  const Error& error() const { return assert(!ok()), *error_; }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace forgescan

#define FORGESCAN_CONCAT_(a, b) a##b
#define FORGESCAN_CONCAT(a, b) FORGESCAN_CONCAT_(a, b)

// Leaves the enclosing function with the error, if there is one.
#define RETURN_IF_ERROR(expression)                                     \
  do {                                                                  \
    if (auto forgescan_status = (expression); !forgescan_status.ok()) { \
      return forgescan_status.error();                                  \
    }                                                                   \
  } while (false)

// ASSIGN_OR_RETURN(auto cloud, ReadPly(path)); declares or assigns on success, leaves with the error
// otherwise.
#define ASSIGN_OR_RETURN(target, expression) \
  ASSIGN_OR_RETURN_IMPL_(FORGESCAN_CONCAT(forgescan_result_, __LINE__), target, expression)
#define ASSIGN_OR_RETURN_IMPL_(result, target, expression) \
  auto result = (expression);                              \
  if (!result.ok()) {                                      \
    return result.error();                                 \
  }                                                        \
  target = std::move(result).value()
