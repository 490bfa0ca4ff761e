#include "drivers/can/can_msgpack.h"

#include <gtest/gtest.h>

#include <random>
#include <string_view>

namespace forgescan {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr CanFrame kFrame{.id = 0x123, .length = 3, .data = {1, 2, 3}};

Bytes Replace(Bytes bytes, std::string_view what, const Bytes& with) {
  const auto at = std::search(bytes.begin(), bytes.end(), what.begin(), what.end());
  EXPECT_NE(at, bytes.end()) << what;
  std::copy(with.begin(), with.end(), at + static_cast<std::ptrdiff_t>(what.size()));
  return bytes;
}

TEST(CanDatagram, ComesBack) {
  for (const CanFrame& frame :
       {kFrame, CanFrame{},
        CanFrame{.id = 0x1FFFFFFF, .extended = true, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}},
        CanFrame{.id = 5, .rtr = true, .length = 4}, CanFrame{.id = 0x40, .error = true, .length = 8}}) {
    const auto decoded = DecodeCanDatagram(EncodeCanDatagram(frame, 1'234'567));
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    EXPECT_EQ(*decoded, frame);
  }
}

// The size that python-can 4.1.0 sends for a frame of three bytes, give or take its shorter integers.
TEST(CanDatagram, HasTheSizeOfPythonCan) {
  EXPECT_NEAR(static_cast<double>(EncodeCanDatagram(kFrame, 0).size()), 157, 2);
}

TEST(CanDatagram, EveryCutIsAnErrorAndNothingElse) {
  const Bytes whole = EncodeCanDatagram(kFrame, 1);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(DecodeCanDatagram(std::span(whole).first(size)).ok()) << size;
  }
}

TEST(CanDatagram, RefusesValuesOutOfRange) {
  const Bytes whole = EncodeCanDatagram(kFrame, 1);
  EXPECT_FALSE(DecodeCanDatagram(Replace(whole, "dlc", {9})).ok());
  EXPECT_FALSE(DecodeCanDatagram(Replace(whole, "dlc", {0xFF})).ok());  // -1
  EXPECT_FALSE(DecodeCanDatagram(Replace(whole, "dlc", {2})).ok());     // three data bytes
  EXPECT_FALSE(DecodeCanDatagram(Replace(whole, "dlc", {0xC3})).ok());  // a flag
  EXPECT_FALSE(DecodeCanDatagram(Replace(whole, "is_fd", {0xC3})).ok());
  EXPECT_FALSE(DecodeCanDatagram(Replace(whole, "arbitration_id", {0xCE, 0, 0, 8, 0})).ok());
  EXPECT_TRUE(DecodeCanDatagram(Replace(whole, "is_extended_id", {0xC3})).ok());
}

TEST(CanDatagram, SkipsWhatItDoesNotKnow) {
  Bytes bytes = EncodeCanDatagram(kFrame, 1);
  bytes[0] = 0x80 | 12;
  const Bytes extra = {0xA1, 'x', 0x92, 0x01, 0x91, 0xCB, 0, 0, 0, 0, 0, 0, 0, 0};  // x: [1, [0.0]]
  bytes.insert(bytes.end(), extra.begin(), extra.end());
  EXPECT_TRUE(DecodeCanDatagram(bytes).ok());
}

TEST(CanDatagram, DeepNestingIsRefused) {
  Bytes bytes = {0x81, 0xA1, 'x'};
  bytes.insert(bytes.end(), 1000, 0x91);
  EXPECT_FALSE(DecodeCanDatagram(bytes).ok());
}

TEST(CanDatagram, NoBytesCrashIt) {
  std::mt19937 random(1);
  const Bytes whole = EncodeCanDatagram(kFrame, 1);
  for (int round = 0; round < 20'000; ++round) {
    Bytes bytes = whole;
    for (int change = 0; change < 1 + round % 4; ++change) {
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    }
    const auto decoded = DecodeCanDatagram(bytes);
    if (decoded.ok()) {
      EXPECT_LE(decoded->length, 8);
      EXPECT_LE(decoded->id, kMaxExtendedCanId);
    }
  }
}

}  // namespace
}  // namespace forgescan
