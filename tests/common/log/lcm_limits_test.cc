// What types that come from a log, and messages of them, can demand of their reader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/common/log/lcm_decode.h"

namespace forgescan {
namespace {

using ::testing::HasSubstr;

LcmTypes Types(const std::string& text) {
  auto types = LcmTypes::Parse(text);
  EXPECT_TRUE(types.ok()) << types.error().message;
  return types.ok() ? *types : LcmTypes();
}

void Append(Bytes& bytes, std::uint64_t value, int count) {
  for (int i = count; i-- > 0;) {
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
}

// A message of the type with nothing in it but its fingerprint.
Bytes Begin(const LcmTypes& types, const char* type) {
  Bytes message;
  Append(message, static_cast<std::uint64_t>(types.Fingerprint(*types.Find(type))), 8);
  return message;
}

TEST(LcmLimits, ACountBeyondTheMessage) {
  const LcmTypes types = Types("struct t { int32_t n; int8_t many[n]; }");
  Bytes message = Begin(types, "t");
  Append(message, 0x7FFFFFFF, 4);
  EXPECT_THAT(DecodeToJson(types, message).error().message, HasSubstr("has 2147483647 elements"));
}

TEST(LcmLimits, ATypeThatContainsItself) {
  const LcmTypes types = Types("struct r { r self[1]; }");
  Bytes message = Begin(types, "r");
  message.resize(1000);
  EXPECT_THAT(DecodeToJson(types, message).error().message, HasSubstr("more than 32 structs"));
}

// 20000 x 20000 arrays or structs in 20 kB.
TEST(LcmLimits, ElementsThatTakeNoBytes) {
  constexpr std::uint32_t kCount = 20'000;
  for (const char* text : {"struct t { int32_t n; int32_t z; int8_t a[n][n][z]; byte pad[n]; }",
                           "struct e { } struct t { int32_t n; int32_t z; e a[n][n]; byte pad[n]; }"}) {
    const LcmTypes types = Types(text);
    Bytes message = Begin(types, "t");
    Append(message, kCount, 4);
    Append(message, 0, 4);
    message.resize(message.size() + kCount);
    EXPECT_THAT(DecodeToJson(types, message).error().message,
                HasSubstr("more values than the message can hold"));
  }
}

TEST(LcmLimits, SmallStructsInStructsAreNotRefused) {
  constexpr std::uint32_t kCount = 100'000;
  const LcmTypes types = Types("struct in { int8_t x; } struct e { in i; } struct t { int32_t n; e a[n]; }");
  Bytes message = Begin(types, "t");
  Append(message, kCount, 4);
  message.resize(message.size() + kCount);
  const auto json = DecodeToJson(types, message);
  ASSERT_TRUE(json.ok()) << json.error().message;
  EXPECT_EQ((*json)["a"].size(), kCount);
}

TEST(LcmLimits, DimensionsMembersAndStructs) {
  std::string dimensions = "struct t { int8_t a", fields = "struct t {", structs;
  for (int i = 0; i < 100'000; ++i) {
    dimensions += "[1]";
    fields += fmt::format("int8_t f{};", i);
    structs += fmt::format("struct s{} {{ }}", i);
  }
  EXPECT_THAT(LcmTypes::Parse(dimensions + "; }").error().message, HasSubstr("more than 16 dimensions"));
  EXPECT_THAT(LcmTypes::Parse(fields + "}").error().message, HasSubstr("more than 5000 members"));
  EXPECT_THAT(LcmTypes::Parse(structs).error().message, HasSubstr("more than 2000 structs"));
}

}  // namespace
}  // namespace forgescan
