#include "services/recorder/retention.h"

#include <fmt/format.h>

#include <algorithm>

#include "fsmsg/verdict_t.hpp"
#include "services/recorder/recording_name.h"

namespace forgescan {
namespace {

constexpr std::int64_t kUsPerDay = 86'400'000'000;

struct Candidate {
  const StoredRecording* file = nullptr;
  RecordingName name;
  bool kept_newest = false;  // one of the newest OK parts
  bool gone = false;

  bool ok() const {
    return name.part.has_value() && name.complete && name.verdict == fsmsg::verdict_t::VERDICT_OK;
  }
  bool free() const { return !file->open && !kept_newest && !gone; }
};

std::string FileName(const std::string& path) { return path.substr(path.find_last_of('/') + 1); }

// Oldest first; the newest OK parts are marked.
std::vector<Candidate> Candidates(const std::vector<StoredRecording>& files, int keep_newest_ok) {
  std::vector<Candidate> candidates;
  for (const StoredRecording& file : files) {
    if (const auto name = ParseRecordingName(FileName(file.path)); name.has_value()) {
      candidates.push_back({&file, *name});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::pair(a.name.utime, a.file->path) < std::pair(b.name.utime, b.file->path);
  });
  int newest = 0;
  for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate) {
    candidate->kept_newest = candidate->ok() && newest++ < keep_newest_ok;
  }
  return candidates;
}

void Delete(Candidate& candidate, std::string reason, RetentionPlan& plan) {
  candidate.gone = true;
  plan.deletions.push_back({candidate.file->path, candidate.file->bytes, std::move(reason)});
}

void DropAged(std::vector<Candidate>& candidates, const RetentionRules& rules, std::int64_t now_us,
              RetentionPlan& plan) {
  for (Candidate& candidate : candidates) {
    if (!candidate.free()) {
      continue;
    }
    if (now_us - candidate.name.utime > rules.keep_days * kUsPerDay) {
      Delete(candidate, fmt::format("older than {} days", rules.keep_days), plan);
    } else if (candidate.ok() && *candidate.name.part % rules.keep_every_nth_ok != 0) {
      Delete(candidate,
             fmt::format("OK, not one of the newest {} and not a multiple of {}", rules.keep_newest_ok,
                         rules.keep_every_nth_ok),
             plan);
    }
  }
}

void DropBeyondQuota(std::vector<Candidate>& candidates, const RetentionRules& rules, RetentionPlan& plan) {
  std::int64_t held_bytes = 0;
  for (const Candidate& candidate : candidates) {
    held_bytes += candidate.gone ? 0 : candidate.file->bytes;
  }
  for (const bool ok : {true, false}) {
    for (Candidate& candidate : candidates) {
      if (held_bytes > rules.quota_bytes && candidate.free() && candidate.ok() == ok) {
        held_bytes -= candidate.file->bytes;
        Delete(candidate, fmt::format("beyond the quota of {} bytes", rules.quota_bytes), plan);
      }
    }
  }
  plan.bytes_over_quota = std::max<std::int64_t>(0, held_bytes - rules.quota_bytes);
}

}  // namespace

RetentionPlan PlanRetention(const std::vector<StoredRecording>& files, const RetentionRules& rules,
                            std::int64_t now_us) {
  RetentionPlan plan;
  std::vector<Candidate> candidates = Candidates(files, rules.keep_newest_ok);
  DropAged(candidates, rules, now_us, plan);
  DropBeyondQuota(candidates, rules, plan);
  return plan;
}

}  // namespace forgescan
