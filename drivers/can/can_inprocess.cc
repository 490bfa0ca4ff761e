#include "drivers/can/can_inprocess.h"

#include <algorithm>
#include <deque>

namespace forgescan {

class InProcessCan::Station final : public CanBus {
 public:
  explicit Station(InProcessCan& wire) : wire_(wire) {}
  ~Station() override {
    std::erase(wire_.stations_, this);
    std::erase_if(wire_.under_way_, [this](const auto& entry) { return entry.second.first == this; });
  }

  Status Send(const CanFrame& frame) override {
    Status status = CheckSendable(frame);
    if (status.ok()) {
      status = wire_.Transmit(this, frame);
    }
    ++(status.ok() ? counters_.sent : counters_.send_failures);
    return status;
  }

  Status Drain() override {
    while (!queue_.empty()) {
      const CanFrame frame = queue_.front();
      queue_.pop_front();
      if (frame.error) {
        ++counters_.bus_offs;
      }
      Deliver(frame);
    }
    return {};
  }

  int fd() const override { return -1; }
  void Enqueue(const CanFrame& frame) { queue_.push_back(frame); }

 private:
  InProcessCan& wire_;
  std::deque<CanFrame> queue_;
};

Status CanFaults::Check() const {
  for (const double probability : {loss, duplicate, reorder}) {
    if (!(probability >= 0 && probability <= 1)) {
      return Fail(ErrorCode::kInvalidArgument, "CAN fault probability {} is outside 0..1", probability);
    }
  }
  if (max_delay_us < 0 || latency_us < 0) {
    return Fail(ErrorCode::kInvalidArgument, "CAN delay {} us or latency {} us is negative", max_delay_us,
                latency_us);
  }
  return {};
}

InProcessCan::InProcessCan(const CanFaults& faults, std::int64_t start_utime)
    : faults_(faults), random_(faults.seed), now_us_(start_utime) {}

InProcessCan::~InProcessCan() { assert(stations_.empty()); }

std::unique_ptr<CanBus> InProcessCan::Attach() {
  auto station = std::make_unique<Station>(*this);
  stations_.push_back(station.get());
  return station;
}

Status InProcessCan::Transmit(const Station* sender, CanFrame frame) {
  if (bus_off_) {
    return Fail(ErrorCode::kUnavailable, "in-process CAN is bus-off at {} us", now_us_);
  }
  for (Station* receiver : stations_) {
    if (receiver == sender || Draw() < faults_.loss) {
      continue;
    }
    Schedule(receiver, frame);
    if (Draw() < faults_.duplicate) {
      Schedule(receiver, frame);
    }
  }
  return {};
}

void InProcessCan::Schedule(Station* receiver, const CanFrame& frame) {
  std::int64_t due_us = now_us_ + faults_.latency_us;
  if (Draw() < faults_.reorder) {
    due_us += static_cast<std::int64_t>(Draw() * static_cast<double>(faults_.max_delay_us));
  }
  under_way_.emplace(due_us, std::pair(receiver, frame));
}

void InProcessCan::StepTo(std::int64_t utime) {
  now_us_ = std::max(now_us_, utime);
  while (!under_way_.empty() && under_way_.begin()->first <= now_us_) {
    auto [receiver, frame] = under_way_.begin()->second;
    frame.utime = under_way_.begin()->first;
    under_way_.erase(under_way_.begin());
    receiver->Enqueue(frame);
  }
}

void InProcessCan::SetBusOff(bool off) {
  if (off && !bus_off_) {
    under_way_.clear();
    for (Station* station : stations_) {
      station->Enqueue(
          {.id = 0x40, .error = true, .length = 8, .utime = now_us_});  // CAN_ERR_BUSOFF of linux/can/error.h
    }
  }
  bus_off_ = off;
}

}  // namespace forgescan
