#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <string_view>
#include <utility>

namespace forgescan::fuzz {
namespace {

using Random = std::mt19937_64;

std::size_t Below(Random& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

// Seldom large: as likely between 1 and 2 as between half the largest and the largest.
std::size_t Size(Random& random, std::size_t doublings) {
  return Below(random, std::size_t{1} << Below(random, doublings + 1)) + 1;
}

// Somewhere in `bytes`, at most `longest` bytes.
std::pair<std::size_t, std::size_t> Block(const std::string& bytes, Random& random, std::size_t longest) {
  const std::size_t from = Below(random, bytes.size());
  return {from, Below(random, std::min(longest, bytes.size() - from) + 1)};
}

void FlipBits(std::string& bytes, Random& random) {
  for (std::size_t i = Below(random, 8) + 1; i > 0 && !bytes.empty(); --i) {
    char& byte = bytes[Below(random, bytes.size())];
    byte = static_cast<char>(byte ^ (1 << Below(random, 8)));
  }
}

void SetBytes(std::string& bytes, Random& random) {
  const auto [from, size] = Block(bytes, random, 16);
  constexpr std::array<unsigned char, 6> kBytes = {0x00, 0xff, 0x7f, 0x80, '\n', ' '};
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(from), size,
              static_cast<char>(kBytes[Below(random, kBytes.size())]));
}

void Truncate(std::string& bytes, Random& random) { bytes.resize(Below(random, bytes.size() + 1)); }

void InsertNoise(std::string& bytes, Random& random) {
  std::string noise(Below(random, 64) + 1, '\0');
  for (char& byte : noise) byte = static_cast<char>(random());
  bytes.insert(Below(random, bytes.size() + 1), noise);
}

void Delete(std::string& bytes, Random& random) {
  const auto [from, size] = Block(bytes, random, Below(random, 4) == 0 ? bytes.size() : 32);
  bytes.erase(from, size);
}

void CopyBlock(std::string& bytes, Random& random) {
  const auto [from, size] = Block(bytes, random, Below(random, 4) == 0 ? 100'000 : 64);
  const std::string block = bytes.substr(from, size);
  const std::size_t to = Below(random, bytes.size() + 1);
  Below(random, 2) == 0 ? bytes.insert(to, block) : bytes.replace(to, size, block);
}

// A number of 1, 2, 4 or 8 bytes, of either byte order, as counts and lengths are written.
void SetBinaryNumber(std::string& bytes, Random& random) {
  constexpr std::array<std::uint64_t, 12> kNumbers = {0,
                                                      1,
                                                      2,
                                                      0x7f,
                                                      0xffff,
                                                      0x7fffffff,
                                                      0x80000000,
                                                      0xffffffff,
                                                      0x7fffffffffffffff,
                                                      0x8000000000000000,
                                                      0x7ff0000000000000,   // infinite as a double
                                                      0xffffffffffffffff};  // not a number
  const std::size_t size = std::size_t{1} << Below(random, 4);
  if (bytes.size() < size) return;
  std::uint64_t number = kNumbers[Below(random, kNumbers.size())] + Below(random, 3) - 1;
  const std::size_t at = Below(random, bytes.size() - size + 1);
  const bool big_endian = Below(random, 2) == 0;
  for (std::size_t i = 0; i < size; ++i, number >>= 8) {
    bytes[at + (big_endian ? size - 1 - i : i)] = static_cast<char>(number & 0xff);
  }
}

bool IsOfNumber(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '+';
}

void SetTextNumber(std::string& bytes, Random& random) {
  constexpr std::array<std::string_view, 22> kNumbers = {"0",
                                                         "-1",
                                                         "1",
                                                         "nan",
                                                         "inf",
                                                         "-inf",
                                                         ".nan",
                                                         "1e308",
                                                         "-1e308",
                                                         "1e400",
                                                         "1e-400",
                                                         "4294967295",
                                                         "4294967296",
                                                         "2147483647",
                                                         "2147483648",
                                                         "-2147483649",
                                                         "9223372036854775807",
                                                         "18446744073709551616",
                                                         "0.0000001",
                                                         "1e",
                                                         "0x10",
                                                         ""};
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(Below(random, bytes.size() + 1));
  const auto digit = std::find_if(begin, bytes.end(), IsOfNumber);
  const auto end = std::find_if_not(digit, bytes.end(), IsOfNumber);
  bytes.replace(digit, end, kNumbers[Below(random, kNumbers.size())]);
}

// A digit more: ten times the count.
void LengthenNumber(std::string& bytes, Random& random) {
  const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(Below(random, bytes.size() + 1));
  const auto digit = std::find_if(begin, bytes.end(), IsOfNumber);
  if (digit != bytes.end())
    bytes.insert(digit, Below(random, 9) + 1, static_cast<char>('1' + Below(random, 9)));
}

std::pair<std::size_t, std::size_t> Line(const std::string& bytes, Random& random) {
  const std::size_t at = Below(random, bytes.size());
  const std::size_t before = at == 0 ? std::string::npos : bytes.rfind('\n', at - 1);
  const std::size_t from = before == std::string::npos ? 0 : before + 1;
  const std::size_t end = std::min(bytes.find('\n', from), bytes.size() - (bytes.empty() ? 0 : 1));
  return {from, std::min<std::size_t>(end + 1 - from, 100'000)};
}

void LoseLine(std::string& bytes, Random& random) {
  if (bytes.empty()) return;
  const auto [from, size] = Line(bytes, random);
  bytes.erase(from, size);
}

void MoveLine(std::string& bytes, Random& random) {
  if (bytes.empty()) return;
  const auto [from, size] = Line(bytes, random);
  const std::string line = bytes.substr(from, size);
  if (Below(random, 2) == 0) bytes.erase(from, size);
  bytes.insert(bytes.empty() ? 0 : Line(bytes, random).first, line);
}

void LongLine(std::string& bytes, Random& random) {
  constexpr std::string_view kFilling = "a1 -.\"";
  bytes.insert(Below(random, bytes.size() + 1), Size(random, 17), kFilling[Below(random, kFilling.size())]);
}

void NestDeeply(std::string& bytes, Random& random) {
  constexpr std::array<std::string_view, 6> kOpenings = {"[", "{", "(", "[[", "{\"a\":", "- "};
  std::string nest;
  const std::string_view opening = kOpenings[Below(random, kOpenings.size())];
  for (std::size_t depth = Size(random, 16); depth > 0; --depth) nest += opening;
  bytes.insert(Below(random, bytes.size() + 1), nest);
}

void WriteCrLf(std::string& bytes, Random&) {
  std::string lines;
  for (const char byte : bytes) lines += byte == '\n' ? "\r\n" : std::string(1, byte);
  bytes = lines.size() <= bytes.size() + kMostAdded / 8 ? lines : bytes;
}

void AddByteOrderMark(std::string& bytes, Random&) { bytes.insert(0, "\xEF\xBB\xBF"); }

void AddZeros(std::string& bytes, Random& random) {
  bytes.insert(Below(random, bytes.size() + 1), Size(random, 13), '\0');
}

using Change = void (*)(std::string&, Random&);
constexpr std::array<Change, 22> kChanges = {
    FlipBits, SetBytes, Truncate, InsertNoise, Delete, CopyBlock, SetBinaryNumber, SetTextNumber, LoseLine,
    MoveLine, LongLine, NestDeeply, WriteCrLf, AddByteOrderMark, AddZeros,
    // The usual ones more often.
    FlipBits, SetBinaryNumber, SetBinaryNumber, SetTextNumber, SetTextNumber, LengthenNumber, CopyBlock};

}  // namespace

std::string Mutate(std::string bytes, std::mt19937_64& random) {
  const std::size_t most = bytes.size() + kMostAdded;
  for (std::size_t changes = Below(random, 4) + 1; changes > 0; --changes) {
    kChanges[Below(random, kChanges.size())](bytes, random);
  }
  bytes.resize(std::min(bytes.size(), most));
  return bytes;
}

}  // namespace forgescan::fuzz
