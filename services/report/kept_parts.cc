#include "services/report/kept_parts.h"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "services/common/bus/codec.h"
#include "services/report/report_files.h"

namespace forgescan {
namespace {

constexpr const char* kNone = "-";

std::string HexOf(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += fmt::format("{:02x}", byte);
  }
  return text;
}

// Nothing if it is not hexadecimal.
std::optional<Bytes> BytesOf(const std::string& hex) {
  Bytes bytes(hex.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* begin = hex.data() + 2 * i;
    if (std::from_chars(begin, begin + 2, bytes[i], 16).ptr != begin + 2) {
      return std::nullopt;
    }
  }
  return hex.size() % 2 == 0 ? std::optional(bytes) : std::nullopt;
}

std::string LineOf(int part, const KeptPart& kept) {
  return fmt::format("{} {} {} {} {}\n", part, kept.first_utime,
                     kept.arrived_utime ? std::to_string(*kept.arrived_utime) : kNone,
                     kept.results_came ? 1 : 0, kept.verdict ? HexOf(Encode(*kept.verdict)) : kNone);
}

// Nothing if the line is none of ours.
std::optional<std::pair<int, KeptPart>> PartOf(const std::string& line) {
  std::istringstream words(line);
  int part = 0;
  KeptPart kept;
  std::string arrived, verdict, rest;
  if (!(words >> part >> kept.first_utime >> arrived >> kept.results_came >> verdict) || (words >> rest)) {
    return std::nullopt;
  }
  if (arrived != kNone) {
    kept.arrived_utime.emplace();
    const char* end = arrived.data() + arrived.size();
    if (std::from_chars(arrived.data(), end, *kept.arrived_utime).ptr != end) {
      return std::nullopt;
    }
  }
  if (verdict == kNone) {
    return std::pair(part, kept);
  }
  const auto bytes = BytesOf(verdict);
  auto message = bytes ? Decode<fsmsg::verdict_t>(*bytes) : Fail(ErrorCode::kFormat, "no bytes");
  if (!message.ok() || message->part != part) {
    return std::nullopt;
  }
  kept.verdict = std::move(*message);
  return std::pair(part, kept);
}

}  // namespace

Status KeptParts::Recall() {
  std::error_code problem;
  if (!std::filesystem::exists(path_, problem)) {
    return {};
  }
  AgedMap<int, KeptPart> read{16};
  std::ifstream stream(path_);
  for (std::string line; std::getline(stream, line);) {
    const auto kept = PartOf(line);
    if (!kept.has_value()) {
      return Fail(ErrorCode::kFormat,
                  "{}: \"{}\" is no part: number, first event, arrival or -, 0/1, verdict or -", path_,
                  line.substr(0, 80));
    }
    read.Insert(kept->first, kept->second);
  }
  if (!stream.eof()) {
    return Fail(ErrorCode::kIo, "{}: cannot be read", path_);
  }
  parts_ = std::move(read);
  return {};
}

Status KeptParts::Write() {
  std::string text;
  parts_.ForEach([&text](int part, const KeptPart& kept) { text += LineOf(part, kept); });
  return WriteWholeFile(path_, text);
}

Status KeptParts::Begin(int part, std::int64_t first_utime) {
  KeptPart kept;
  kept.first_utime = first_utime;
  parts_.Insert(part, std::move(kept));
  return Write();
}

Status KeptParts::Arrived(int part, std::int64_t utime) {
  KeptPart* kept = parts_.Find(part);
  if (kept == nullptr || kept->arrived_utime == utime) {
    return {};
  }
  kept->arrived_utime = utime;
  return Write();
}

Status KeptParts::ResultsCame(int part) {
  KeptPart* kept = parts_.Find(part);
  if (kept == nullptr || kept->results_came) {
    return {};
  }
  kept->results_came = true;
  return Write();
}

Status KeptParts::Judged(const fsmsg::verdict_t& verdict) {
  KeptPart* kept = parts_.Find(verdict.part);
  if (kept == nullptr) {
    return {};
  }
  kept->verdict = verdict;
  return Write();
}

Status KeptParts::Sorted(int part) {
  const KeptPart* kept = parts_.Find(part);
  if (kept == nullptr || !kept->verdict.has_value()) {  // a part in work is not forgotten for a stray word
    return {};
  }
  parts_.Take(part);
  return Write();
}

}  // namespace forgescan
