// LCM's type definitions, read at run time: which types a text defines, their fingerprints, their fields.
// With them a log can be understood whose types this program was not built with.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/bus/bus.h"
#include "services/common/result.h"

namespace forgescan {

// Structs within structs.
inline constexpr std::size_t kMaxLcmDepth = 32;
// Of an array.
inline constexpr std::size_t kMaxLcmDimensions = 16;
// Fields and constants of a struct.
inline constexpr std::size_t kMaxLcmMembers = 5000;
// In one text.
inline constexpr std::size_t kMaxLcmStructs = 2000;

enum class LcmPrimitive { kInt8, kInt16, kInt32, kInt64, kByte, kFloat, kDouble, kString, kBoolean };

struct LcmDimension {
  std::string size;         // as written: a number, or the name of an earlier field of the same struct
  std::int64_t fixed = 0;   // the number; 0 = given by a field
  std::size_t counter = 0;  // index of that field
};

struct LcmField {
  std::string name;
  std::string type;                       // of an element: a primitive, or a struct with its package
  std::optional<LcmPrimitive> primitive;  // nothing = a struct
  std::vector<LcmDimension> dimensions;   // none = one value
};

struct LcmConstant {
  std::string name;
  std::string type;
  std::string value;  // as written
};

struct LcmStruct {
  std::string name;  // with its package, e.g. fsmsg.frame_t
  std::vector<LcmField> fields;
  std::vector<LcmConstant> constants;
  // True if the struct begins with the fields of a stream message (services/common/bus/stream_header.h).
  bool IsStream() const;
};

// The structs of a text in LCM's language, in its order: packages, several structs, comments, constants,
// arrays. Enumerations are refused: lcm-gen writes no valid C++ for them. Errors: kFormat (with the line;
// also for more structs, members or dimensions than the limits above).
Result<std::vector<LcmStruct>> ParseLcmDefinitions(std::string_view text);

// Types that are complete: every struct that a field names is among them.
class LcmTypes {
 public:
  LcmTypes() = default;
  // Errors: kFormat (as above; a type is unknown, defined twice, or contains more than 5000
  // structs or more than 32 in each other).
  static Result<LcmTypes> Parse(std::string_view text);

  const std::vector<LcmStruct>& structs() const { return structs_; }
  const LcmStruct* Find(std::string_view name) const;
  // Types with equal fields share a fingerprint; the first defined is found.
  const LcmStruct* FindByFingerprint(std::int64_t fingerprint) const;
  // The type of an encoded message; null if it is unknown or the message has no 8 bytes.
  const LcmStruct* TypeOf(ByteView message) const;
  // LCM's, the first 8 bytes of every message of the type. type: one of structs().
  std::int64_t Fingerprint(const LcmStruct& type) const;

 private:
  // Types that are being summed up: LCM counts a type within itself as 0.
  std::uint64_t Hash(const LcmStruct& type, std::vector<const LcmStruct*>& within) const;

  std::vector<LcmStruct> structs_;
  std::vector<std::uint64_t> own_hashes_;  // of the fields alone, by struct
  std::map<std::string, std::size_t, std::less<>> by_name_;
  std::map<std::int64_t, std::size_t> by_fingerprint_;
};

}  // namespace forgescan
