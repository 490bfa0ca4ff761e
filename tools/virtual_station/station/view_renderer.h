// Renders the images of a view before the robot is there, on a thread of its own and at low priority: what a
// user waits for is the cell's motion, not its picture.
#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {

using GreyImage = std::vector<std::uint8_t>;

// A view of a part, taken for the first time (0) or again.
struct ViewVisit {
  int part = 0, view = 0, visit = 0;
  bool operator==(const ViewVisit&) const = default;
};

// All images of one visit, in the order of projection.
struct RenderedView {
  ViewState state;
  std::array<std::vector<std::shared_ptr<const GreyImage>>, 2> images;  // left, right
};

// Thread-safe.
class ViewRenderer {
 public:
  ViewRenderer(const VirtualCell& cell, ProjectedSet set);
  ~ViewRenderer();
  ViewRenderer(const ViewRenderer&) = delete;
  ViewRenderer& operator=(const ViewRenderer&) = delete;

  // Prepares the part's mesh; costs the worker 0.3 s that the first view then does not wait for.
  void PreparePart(int part);
  // `time_s`: of the exposure, after the part had its start temperature.
  void Request(const ViewVisit& visit, double time_s);
  // Null while it is not rendered, and again when newer views have taken its place.
  std::shared_ptr<const RenderedView> Find(const ViewVisit& visit) const;
  // The part, when it is prepared; null before.
  std::shared_ptr<const PartState> Part(int part) const;
  // The first thing that went wrong; ok = nothing.
  Status status() const;

 private:
  struct Job {
    int part;
    std::optional<ViewVisit> visit;  // none = only the part
    double time_s;
  };
  void Work();
  void Do(const Job& job);
  Result<std::shared_ptr<const PartState>> EnsurePart(int part);
  Result<std::shared_ptr<const RenderedView>> Render(const PartState& part, const Job& job) const;

  const VirtualCell& cell_;
  const std::vector<Pattern> patterns_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::deque<Job> jobs_;
  std::deque<std::shared_ptr<const PartState>> parts_;
  std::deque<std::shared_ptr<const RenderedView>> views_;
  std::optional<Error> error_;
  std::jthread worker_;
};

}  // namespace forgescan
