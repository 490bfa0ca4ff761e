#include "services/camera/view_book.h"

#include <fmt/format.h>

#include <algorithm>

namespace forgescan {
namespace {

constexpr std::size_t kMaxOpen = 16;     // one is being exposed, a few wait for late frames
constexpr std::size_t kClosedKept = 64;  // some parts back

}  // namespace

ViewBook::View* ViewBook::Open(const Key& key, std::int64_t utime) {
  const bool closed = std::any_of(closed_.begin(), closed_.end(),
                                  [&](const Closed& one) { return one.key == key && utime <= one.utime; });
  if (closed) {
    return nullptr;
  }
  if (views_.size() >= kMaxOpen && !views_.contains(key)) {
    const auto oldest = std::min_element(views_.begin(), views_.end(), [](const auto& a, const auto& b) {
      return a.second.order < b.second.order;
    });
    views_.erase(oldest);
  }
  const auto [entry, is_new] = views_.try_emplace(key);
  if (is_new) {
    entry->second.order = next_order_++;
  }
  return &entry->second;
}

void ViewBook::Close(const Key& key, std::int64_t utime) {
  views_.erase(key);
  closed_.push_back({key, utime});
  if (closed_.size() > kClosedKept) {
    closed_.pop_front();
  }
}

void ViewBook::OnSent(const fsmsg::exposure_t& exposure) {
  if (View* view = Open(KeyOf(exposure), exposure.utime)) {
    ++view->frames_sent;
  }
}

void ViewBook::OnMissing(const fsmsg::exposure_t& exposure, const std::string& reason) {
  View* view = Open(KeyOf(exposure), exposure.utime);
  if (view == nullptr) {
    return;
  }
  ++view->frames_missing;
  if (view->reason.empty()) {
    view->reason = reason;
  }
}

void ViewBook::OnLate(const fsmsg::exposure_t& exposure) {
  if (View* view = Open(KeyOf(exposure), exposure.utime)) {
    ++view->frames_late;
  }
}

void ViewBook::OnDuplicate(const fsmsg::exposure_t& exposure) {
  if (View* view = Open(KeyOf(exposure), exposure.utime)) {
    ++view->frames_duplicate;
  }
}

void ViewBook::OnCaptured(const fsmsg::view_captured_t& captured) {
  if (captured.status != fsmsg::view_captured_t::STATUS_CAPTURED) {
    Close(KeyOf(captured), captured.utime);
  } else if (View* view = Open(KeyOf(captured), captured.utime)) {
    view->captured = captured;
  }
}

void ViewBook::Expire(const Key& key) {
  const auto found = views_.find(key);
  if (found == views_.end() || !found->second.captured.has_value()) {
    return;
  }
  View& view = found->second;
  const int open = view.captured->pulses_expected - view.frames_sent - view.frames_missing;
  view.frames_missing += open;
  if (view.reason.empty()) {
    view.reason = fmt::format("the exposure records of {} pulses never came", open);
  }
}

std::vector<fsmsg::view_frames_t> ViewBook::TakeClosed() {
  std::vector<fsmsg::view_frames_t> closed;
  for (auto entry = views_.begin(); entry != views_.end();) {
    const View& view = entry->second;
    if (!view.captured.has_value() ||
        view.frames_sent + view.frames_missing < view.captured->pulses_expected) {
      ++entry;
      continue;
    }
    fsmsg::view_frames_t manifest{};
    manifest.utime = view.captured->utime;
    std::tie(manifest.part, manifest.view, manifest.attempt) = entry->first;
    manifest.camera = camera_;
    manifest.frames_expected = view.captured->pulses_expected;
    manifest.frames_sent = view.frames_sent;
    manifest.frames_missing = view.frames_missing;
    manifest.frames_late = view.frames_late;
    manifest.frames_duplicate = view.frames_duplicate;
    manifest.reason = view.reason;
    closed.push_back(manifest);
    ++entry;
  }
  for (const fsmsg::view_frames_t& manifest : closed) {
    Close({manifest.part, manifest.view, manifest.attempt}, manifest.utime);
  }
  return closed;
}

}  // namespace forgescan
