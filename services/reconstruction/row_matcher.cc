#include "services/reconstruction/row_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace forgescan {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Whether pixels u and u + 1 of a row form a pair; false for NaN.
inline bool IsPair(const CoordinateRow& row, std::size_t u) {
  const float step = row.coordinate_px[u + 1] - row.coordinate_px[u];
  return row.max_slope > 0 ? (step >= row.min_slope && step <= row.max_slope)
                           : (step <= row.min_slope && step >= row.max_slope);
}

void Resize(std::size_t length, RowMatch& match) {
  match.partner_px.assign(length, kNan);
  match.partner_slope.assign(length, kNan);
  match.outcome.assign(length, MatchOutcome::kNone);
}

}  // namespace

RowMatcher::RowMatcher(int coordinate_count) : buckets_(static_cast<std::size_t>(coordinate_count) + 2) {}

void RowMatcher::Index(const CoordinateRow& row) {
  std::fill(buckets_.begin(), buckets_.end(), Range{std::numeric_limits<int>::max(), -1});
  const int top = static_cast<int>(buckets_.size()) - 1;
  for (std::size_t u = 0; u + 1 < row.coordinate_px.size(); ++u) {
    if (!IsPair(row, u)) {
      continue;
    }
    const auto [low, high] = std::minmax(row.coordinate_px[u], row.coordinate_px[u + 1]);
    const int first = std::clamp(static_cast<int>(low + 1), 0, top);  // + 1: the field begins at -0.5
    const int last = std::clamp(static_cast<int>(high + 1), 0, top);
    for (int bucket = first; bucket <= last; ++bucket) {
      Range& range = buckets_[static_cast<std::size_t>(bucket)];
      range.first = std::min(range.first, static_cast<int>(u));
      range.last = static_cast<int>(u);
    }
  }
}

void RowMatcher::Search(const CoordinateRow& from, const CoordinateRow& into, RowMatch& match) {
  Resize(from.coordinate_px.size(), match);
  const int top = static_cast<int>(buckets_.size()) - 1;
  for (std::size_t u = 0; u < from.coordinate_px.size(); ++u) {
    const float wanted = from.coordinate_px[u];
    if (std::isnan(wanted)) {
      continue;
    }
    const Range range = buckets_[static_cast<std::size_t>(std::clamp(static_cast<int>(wanted + 1), 0, top))];
    int found = 0;
    for (int v = range.first; v <= range.last; ++v) {
      const auto at = static_cast<std::size_t>(v);
      const float begin = into.coordinate_px[at];
      const float step = into.coordinate_px[at + 1] - begin;
      const float part = (wanted - begin) / step;
      if (part >= 0 && part < 1 && IsPair(into, at)) {
        ++found;
        match.partner_px[u] = static_cast<float>(v) + part;
        match.partner_slope[u] = step;
      }
    }
    match.outcome[u] = found == 1   ? MatchOutcome::kMatched
                       : found == 0 ? MatchOutcome::kNoPartner
                                    : MatchOutcome::kAmbiguous;
  }
}

const RowMatch& RowMatcher::Match(const CoordinateRow& left, const CoordinateRow& right,
                                  float max_left_right_px) {
  Index(left);
  Search(right, left, backward_);
  Index(right);
  Search(left, right, forward_);
  for (std::size_t u = 0; u < left.coordinate_px.size(); ++u) {
    if (forward_.outcome[u] != MatchOutcome::kMatched) {
      continue;
    }
    const auto v = static_cast<std::size_t>(forward_.partner_px[u]);
    const float part = forward_.partner_px[u] - static_cast<float>(v);
    if (backward_.outcome[v] == MatchOutcome::kAmbiguous ||
        backward_.outcome[v + 1] == MatchOutcome::kAmbiguous) {
      forward_.outcome[u] = MatchOutcome::kAmbiguous;
      continue;
    }
    const float back = (1 - part) * backward_.partner_px[v] + part * backward_.partner_px[v + 1];
    if (!(std::abs(back - static_cast<float>(u)) <= max_left_right_px)) {  // also when there is no way back
      forward_.outcome[u] = MatchOutcome::kLeftRight;
    }
  }
  return forward_;
}

}  // namespace forgescan
