#include "services/camera/view_book.h"

#include <fmt/format.h>

namespace forgescan {

void ViewBook::OnMissing(const fsmsg::exposure_t& exposure, const std::string& reason) {
  View& view = views_[KeyOf(exposure)];
  ++view.frames_missing;
  if (view.reason.empty()) {
    view.reason = reason;
  }
}

void ViewBook::OnCaptured(const fsmsg::view_captured_t& captured) {
  if (captured.status == fsmsg::view_captured_t::STATUS_CAPTURED) {
    views_[KeyOf(captured)].captured = captured;
  } else {
    views_.erase(KeyOf(captured));
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
    entry = views_.erase(entry);
  }
  return closed;
}

}  // namespace forgescan
