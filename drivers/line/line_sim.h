// The production line in simulated time: a part every takt, its temperature, a gate, and faults on request.
#pragma once

#include <functional>
#include <vector>

#include "drivers/line/line.h"

namespace forgescan {

struct LineSimConfig {
  std::uint32_t first_part = 1;
  std::int64_t first_after_us = 1'000'000;  // from the first Step to the first part in place
  std::int64_t takt_us = 45'000'000;
  std::int64_t dwell_us = 40'000'000;  // that a part stays in place; shorter than the takt
  std::int64_t gate_us = 300'000;
  int parts = 0;  // 0: for ever
};

struct LineSimFaults {
  bool lost_echo = false;    // sort commands arrive, no echo is sent
  bool wrong_echo = false;   // echoes another verdict
  bool stuck_valve = false;  // the gate never gets there
  bool pyrometer_blind = false;
  std::int64_t late_us = 0;  // every next part comes later by this
};

class LineSim final : public LineSignals {
 public:
  // Temperature of a part at a time, degC; what the pyrometer reads. NaN: it sees no part.
  using Temperature = std::function<double(std::uint32_t part, std::int64_t in_place_us)>;

  explicit LineSim(const LineSimConfig& config = {}) : config_(config) {}

  Status Send(const LineCommand& command) override;
  void Step(std::int64_t now_us) override;

  // Parts leave and come later by this; the gate is another mechanism.
  void HoldParts(std::int64_t longer_us) {
    in_place_us_ += longer_us;
    next_part_us_ += longer_us;
  }
  void SetTemperature(Temperature temperature) { temperature_ = std::move(temperature); }
  void SetFaults(const LineSimFaults& faults) { faults_ = faults; }
  // What the gate did, in order: one entry for each part.
  const std::vector<LineCommand>& sorted() const { return sorted_; }
  const LinePart& part() const { return part_; }

 private:
  void MoveParts();
  void MoveGate();
  void ReportPyrometer();
  void Echo();

  LineSimConfig config_;
  LineSimFaults faults_;
  Temperature temperature_;
  LinePart part_;
  LineSortEcho echo_;
  std::vector<LineCommand> sorted_;
  bool started_ = false;
  int arrived_ = 0;
  std::int64_t now_us_ = 0;
  std::int64_t next_part_us_ = 0;
  std::int64_t in_place_us_ = 0;
  std::int64_t gate_done_us_ = 0;
  std::int64_t next_report_us_ = 0;
};

}  // namespace forgescan
