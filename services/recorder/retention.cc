#include "services/recorder/retention.h"

#include <fmt/format.h>

#include <algorithm>

#include "fsmsg/verdict_t.hpp"
#include "services/recorder/recording_name.h"

namespace forgescan {
namespace {

constexpr std::int64_t kUsPerDay = 86'400'000'000;

// 2026-01-01, before the first station recorded anything: a clock that nobody has set says less.
constexpr std::int64_t kFirstUtime = 1'767'225'600'000'000;

struct Candidate {
  const StoredRecording* file = nullptr;
  RecordingName name;
  std::int64_t utime = 0;    // of the recording, as far as it can be believed
  bool unknown_age = false;  // its time cannot be believed; utime is now then
  bool kept_newest = false;  // one of the newest OK parts
  bool fresh = false;        // a .part that somebody may still be at
  bool gone = false;

  bool ok() const {
    return name.part.has_value() && name.complete && name.verdict == fsmsg::verdict_t::VERDICT_OK;
  }
  bool free() const { return !file->open && !kept_newest && !fresh && !gone; }
};

std::string FileName(const std::string& path) { return path.substr(path.find_last_of('/') + 1); }

// Oldest first; the newest OK parts are marked.
std::vector<Candidate> Candidates(const std::vector<StoredRecording>& files, int keep_newest_ok,
                                  std::int64_t now_us) {
  std::vector<Candidate> candidates;
  for (const StoredRecording& file : files) {
    const auto name = ParseRecordingName(FileName(file.path));
    if (!name.has_value()) {
      continue;
    }
    Candidate candidate{.file = &file, .name = *name};
    candidate.utime = std::max(name->utime, file.changed_us);
    candidate.unknown_age = candidate.utime < kFirstUtime || candidate.utime > now_us + kUsPerDay;
    candidate.utime = candidate.unknown_age ? now_us : candidate.utime;
    candidate.fresh = !name->closed && file.changed_us != 0 && now_us - file.changed_us < kUsPerDay;
    candidates.push_back(candidate);
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::pair(a.utime, a.file->path) < std::pair(b.utime, b.file->path);
  });
  int newest = 0;
  for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate) {
    candidate->kept_newest = candidate->ok() && !candidate->unknown_age && newest++ < keep_newest_ok;
  }
  return candidates;
}

void Delete(Candidate& candidate, std::string reason, RetentionPlan& plan) {
  candidate.gone = true;
  plan.deletions.push_back({candidate.file->path, candidate.file->bytes, std::move(reason)});
}

// What is older than this is beyond its time, and no pause of the clock is in doubt.
struct AgeLimit {
  std::int64_t from_us = 0;
  std::int64_t pause_us = 0;  // before which nothing goes; 0 = no pause in doubt
};

AgeLimit LimitOf(const std::vector<Candidate>& candidates, std::int64_t keep_us, std::int64_t now_us) {
  AgeLimit limit{now_us - keep_us, 0};
  std::int64_t since_us = now_us;
  for (auto candidate = candidates.rbegin(); candidate != candidates.rend(); ++candidate) {
    if (candidate->file->open) {
      continue;  // made with the clock that is to be judged
    }
    if (since_us - candidate->utime > keep_us && now_us - since_us <= keep_us) {
      return {INT64_MIN, since_us - candidate->utime};
    }
    since_us = std::min(since_us, candidate->utime);
  }
  return limit;
}

void DropAged(std::vector<Candidate>& candidates, const RetentionRules& rules, std::int64_t now_us,
              RetentionPlan& plan) {
  const std::int64_t keep_us = rules.keep_days * kUsPerDay;
  const AgeLimit limit = LimitOf(candidates, keep_us, now_us);
  for (Candidate& candidate : candidates) {
    if (!candidate.free() || candidate.unknown_age) {
      continue;
    }
    if (candidate.utime < limit.from_us) {
      Delete(candidate, fmt::format("older than {} days", rules.keep_days), plan);
    } else if (candidate.ok() && *candidate.name.part % rules.keep_every_nth_ok != 0) {
      Delete(candidate,
             fmt::format("OK, not one of the newest {} and not a multiple of {}", rules.keep_newest_ok,
                         rules.keep_every_nth_ok),
             plan);
    } else if (limit.pause_us > 0 && now_us - candidate.utime > keep_us) {
      plan.doubt = fmt::format(
          "recordings older than {} days are kept: for {} days nothing was recorded, or the clock is wrong",
          rules.keep_days, limit.pause_us / kUsPerDay);
    }
  }
}

// The oldest OK parts first, then the oldest others.
void DropBeyondQuota(std::vector<Candidate>& candidates, const RetentionRules& rules, RetentionPlan& plan) {
  std::int64_t excess_bytes = -rules.quota_bytes;
  for (const Candidate& candidate : candidates) {
    excess_bytes += candidate.gone ? 0 : candidate.file->bytes;
  }
  for (const bool ok : {true, false}) {
    for (Candidate& candidate : candidates) {
      if (excess_bytes > 0 && candidate.free() && candidate.ok() == ok) {
        excess_bytes -= candidate.file->bytes;
        Delete(candidate, fmt::format("beyond the quota of {} bytes", rules.quota_bytes), plan);
      }
    }
  }
  plan.bytes_over_quota = std::max<std::int64_t>(0, excess_bytes);
}

// The oldest OK parts of a disk, if that makes enough room: others are evidence, and a disk that something
// else has filled is nothing recordings have to pay for.
void DropForSpace(std::vector<Candidate>& candidates, const RetentionRules& rules, const FreeSpace& free,
                  RetentionPlan& plan) {
  for (const auto& [disk, free_bytes] : free) {
    std::int64_t missing_bytes = rules.min_free_bytes - free_bytes;
    std::vector<Candidate*> enough;
    for (Candidate& candidate : candidates) {
      missing_bytes -= candidate.gone && candidate.file->disk == disk ? candidate.file->bytes : 0;
    }
    for (Candidate& candidate : candidates) {
      if (missing_bytes > 0 && candidate.free() && candidate.ok() && candidate.file->disk == disk) {
        missing_bytes -= candidate.file->bytes;
        enough.push_back(&candidate);
      }
    }
    if (missing_bytes > 0) {
      continue;
    }
    for (Candidate* candidate : enough) {
      Delete(*candidate, fmt::format("less than {} bytes are free", rules.min_free_bytes), plan);
    }
  }
}

}  // namespace

RetentionPlan PlanRetention(const std::vector<StoredRecording>& files, const RetentionRules& rules,
                            const FreeSpace& free, std::int64_t now_us) {
  RetentionPlan plan;
  std::vector<Candidate> candidates = Candidates(files, rules.keep_newest_ok, now_us);
  DropAged(candidates, rules, now_us, plan);
  DropBeyondQuota(candidates, rules, plan);
  DropForSpace(candidates, rules, free, plan);
  return plan;
}

}  // namespace forgescan
