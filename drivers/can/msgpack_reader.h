// Reads MessagePack values one after the other from bytes that nobody vouches for.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace forgescan {

// One MessagePack value: what this format can hold, the rest is skipped.
struct MsgpackValue {
  enum class Kind { kOther, kBool, kInteger, kBytes, kMap } kind = Kind::kOther;
  bool flag = false;
  std::int64_t integer = 0;  // also the number of pairs of a map
  std::span<const std::uint8_t> bytes = {};
};

class MsgpackReader {
 public:
  explicit MsgpackReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  // Maps are returned opened: the caller reads the pairs. Arrays are skipped whole. Nothing when cut short.
  std::optional<MsgpackValue> Next(int depth = 0);
  bool SkipValue(int depth);
  bool empty() const { return rest_.empty(); }

 private:
  std::optional<std::uint64_t> TakeBigEndian(std::size_t count);
  std::optional<std::span<const std::uint8_t>> Take(std::size_t count);
  std::optional<MsgpackValue> TakeBytes(std::optional<std::uint64_t> count);
  std::optional<MsgpackValue> TakeArray(std::optional<std::uint64_t> count, int depth);
  std::optional<MsgpackValue> TakeOther(std::size_t count);
  std::optional<MsgpackValue> TakeInteger(std::uint8_t tag);
  std::optional<MsgpackValue> TakeSized(std::uint8_t tag, int depth);

  std::span<const std::uint8_t> rest_;
};

}  // namespace forgescan
