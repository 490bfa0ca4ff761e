// Keeps count of the pulses and frames of every view of one camera, until the view can be closed with a
// manifest. Pure.
//
//   open --"captured" and every pulse has its frame or is known to be missing--> closed: one manifest
//        --Expire()---------------------------------------------------------^   what is open counts as
//        missing
//        --void capture--> forgotten: nobody waits for its frames
#pragma once

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

  void OnSent(const fsmsg::exposure_t& exposure) { ++views_[KeyOf(exposure)].frames_sent; }
  void OnMissing(const fsmsg::exposure_t& exposure, const std::string& reason);
  void OnLate(const fsmsg::exposure_t& exposure) { ++views_[KeyOf(exposure)].frames_late; }
  void OnDuplicate(const fsmsg::exposure_t& exposure) { ++views_[KeyOf(exposure)].frames_duplicate; }
  void OnCaptured(const fsmsg::view_captured_t& captured);
  // Closes the view whatever is open; for views whose exposure records never came.
  void Expire(const Key& key);

  // Manifests of the views that can be closed now; each view comes once.
  std::vector<fsmsg::view_frames_t> TakeClosed();

  static Key KeyOf(const fsmsg::exposure_t& exposure) {
    return {exposure.part, exposure.view, exposure.attempt};
  }
  static Key KeyOf(const fsmsg::view_captured_t& captured) {
    return {captured.part, captured.view, captured.attempt};
  }

 private:
  struct View {
    int frames_sent = 0;
    int frames_missing = 0;
    int frames_late = 0;
    int frames_duplicate = 0;
    std::string reason;  // of the first missing frame
    std::optional<fsmsg::view_captured_t> captured;
  };

  std::int8_t camera_;
  std::map<Key, View> views_;
};

}  // namespace forgescan
