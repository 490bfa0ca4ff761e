// Keeps count of the pulses and frames of every view of one camera, until the view can be closed with a
// manifest. Pure.
//
//   open --"captured" and every pulse has its frame or is known to be missing--> closed: one manifest
//        --Expire()---------------------------------------------------------^   what is open counts as
//        missing
//        --void capture--> closed without a manifest: nobody waits for its frames
//        --too many others after it--> closed without a manifest: its end was never heard
// What comes for a closed view has no effect. A view with the same numbers is a new one if its pulses are
// younger than the end of the closed one: the line may count parts from the beginning again.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "fsmsg/exposure_t.hpp"
#include "fsmsg/view_captured_t.hpp"
#include "fsmsg/view_frames_t.hpp"

namespace forgescan {

class ViewBook {
 public:
  using Key = std::tuple<int, int, int>;  // part, view, attempt

  explicit ViewBook(std::int8_t camera) : camera_(camera) {}

  void OnSent(const fsmsg::exposure_t& exposure);
  void OnMissing(const fsmsg::exposure_t& exposure, const std::string& reason);
  void OnLate(const fsmsg::exposure_t& exposure);
  void OnDuplicate(const fsmsg::exposure_t& exposure);
  void OnCaptured(const fsmsg::view_captured_t& captured);
  // Closes the view whatever is open; for views whose exposure records never came.
  void Expire(const Key& key);

  // Manifests of the views that can be closed now; each view comes once.
  std::vector<fsmsg::view_frames_t> TakeClosed();

  std::size_t open_views() const { return views_.size(); }

  static Key KeyOf(const fsmsg::exposure_t& exposure) {
    return {exposure.part, exposure.view, exposure.attempt};
  }
  static Key KeyOf(const fsmsg::view_captured_t& captured) {
    return {captured.part, captured.view, captured.attempt};
  }

 private:
  struct Closed {
    Key key;
    std::int64_t utime;  // end of its last exposure, or of giving up
  };
  struct View {
    std::uint64_t order = 0;  // of its first news
    int frames_sent = 0;
    int frames_missing = 0;
    int frames_late = 0;
    int frames_duplicate = 0;
    std::string reason;  // of the first missing frame
    std::optional<fsmsg::view_captured_t> captured;
  };

  // Nothing if the view is closed.
  View* Open(const Key& key, std::int64_t utime);
  void Close(const Key& key, std::int64_t utime);

  std::int8_t camera_;
  std::uint64_t next_order_ = 1;
  std::map<Key, View> views_;  // bounded
  std::deque<Closed> closed_;  // bounded, oldest first
};

}  // namespace forgescan
