#include "tools/virtual_station/station/view_renderer.h"

#include <sys/resource.h>
#include <unistd.h>

namespace forgescan {
namespace {

constexpr std::size_t kPartsKept = 3;
constexpr std::size_t kViewsKept = 3;  // 80 MB each at full size
constexpr int kNice = 10;              // behind everything that has a deadline

}  // namespace

ViewRenderer::ViewRenderer(const VirtualCell& cell, ProjectedSet set)
    : cell_(cell), patterns_(cell.Patterns(set)), worker_([this] { Work(); }) {}

ViewRenderer::~ViewRenderer() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
}

void ViewRenderer::PreparePart(int part) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back({part, std::nullopt, 0.0});
  }
  wake_.notify_one();
}

void ViewRenderer::Request(const ViewVisit& visit, double time_s) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back({visit.part, visit, time_s});
  }
  wake_.notify_one();
}

std::shared_ptr<const RenderedView> ViewRenderer::Find(const ViewVisit& visit) const {
  const std::lock_guard lock(mutex_);
  for (const auto& rendered : views_) {
    const ViewState& state = rendered->state;
    if (ViewVisit{state.part, state.view, state.visit} == visit) {
      return rendered;
    }
  }
  return nullptr;
}

std::shared_ptr<const PartState> ViewRenderer::Part(int part) const {
  const std::lock_guard lock(mutex_);
  for (const auto& held : parts_) {
    if (held->part == part) {
      return held;
    }
  }
  return nullptr;
}

Status ViewRenderer::status() const {
  const std::lock_guard lock(mutex_);
  return error_.has_value() ? Status(*error_) : Status();
}

void ViewRenderer::Work() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // threads it starts inherit it
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || !jobs_.empty(); });
    if (stop_) {
      return;
    }
    const Job job = jobs_.front();
    jobs_.pop_front();
    lock.unlock();
    Do(job);
    lock.lock();
  }
}

void ViewRenderer::Do(const Job& job) {
  const auto part = EnsurePart(job.part);
  std::optional<Error> failed = part.ok() ? std::nullopt : std::optional(part.error());
  std::shared_ptr<const RenderedView> rendered;
  if (part.ok() && job.visit.has_value()) {
    const auto view = Render(**part, job);
    failed = view.ok() ? std::nullopt : std::optional(view.error());
    rendered = view.ok() ? *view : nullptr;
  }
  const std::lock_guard lock(mutex_);
  if (failed.has_value() && !error_.has_value()) {
    error_ = failed;
  }
  if (rendered != nullptr) {
    views_.push_back(rendered);
    while (views_.size() > kViewsKept) {
      views_.pop_front();
    }
  }
}

Result<std::shared_ptr<const PartState>> ViewRenderer::EnsurePart(int part) {
  if (auto held = Part(part); held != nullptr) {
    return held;
  }
  ASSIGN_OR_RETURN(PartState made, cell_.Part(part));
  const auto state = std::make_shared<const PartState>(std::move(made));
  const std::lock_guard lock(mutex_);
  parts_.push_back(state);
  while (parts_.size() > kPartsKept) {
    parts_.pop_front();
  }
  return state;
}

Result<std::shared_ptr<const RenderedView>> ViewRenderer::Render(const PartState& part,
                                                                 const Job& job) const {
  auto rendered = std::make_shared<RenderedView>();
  ASSIGN_OR_RETURN(rendered->state, cell_.View(part, job.visit->view, job.time_s, job.visit->visit));
  for (const Side side : {Side::kLeft, Side::kRight}) {
    ASSIGN_OR_RETURN(const GeometryMap map, cell_.Map(part, rendered->state, side));
    auto& images = rendered->images[side == Side::kLeft ? 0 : 1];
    for (std::size_t i = 0; i < patterns_.size(); ++i) {
      images.push_back(std::make_shared<const GreyImage>(
          cell_.Image(map, rendered->state, side, patterns_[i], static_cast<int>(i))));
    }
  }
  return std::shared_ptr<const RenderedView>(rendered);
}

}  // namespace forgescan
