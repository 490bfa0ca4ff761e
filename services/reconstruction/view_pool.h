// Maps of decoded views that are no longer needed, kept for the next ones.
#pragma once

#include <mutex>
#include <vector>

#include "services/reconstruction/decoded_view.h"

namespace forgescan {

// Gives the maps of a view of this size their shapes, any content, and large pages if they are new. Maps that
// have the shape already stay.
void CreateMaps(cv::Size size, DecodedView& view);

// The first touch of 30 MB of fresh memory takes about as long as decoding into it. May be used from any
// thread.
class ViewPool {
 public:
  // Keeps the maps of a view unless somebody else still holds one, or two views (both cameras) are kept
  // already.
  void Give(DecodedView view);

  // A view whose maps have this size and any content.
  DecodedView Take(cv::Size size);

 private:
  std::mutex mutex_;
  std::vector<DecodedView> views_;
};

}  // namespace forgescan
