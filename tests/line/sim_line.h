// The whole line in one process and in simulated time: every service on its own node of a SimNetwork, with
// simulated devices and cameras behind them. The cameras see the images of a RenderedCell, fired by the
// edges of the simulated trigger. Public headers of the simulator stay out of here, see rendered_cell.h.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera_sim.h"
#include "drivers/cooling/cooling_sim.h"
#include "drivers/line/line_sim.h"
#include "drivers/robot/robot_sim.h"
#include "drivers/trigger/trigger_sim.h"
#include "services/camera/camera_service.h"
#include "services/common/bus/sim_bus.h"
#include "services/common/service/station.h"
#include "services/cooling/cooling_service.h"
#include "services/recorder/recorder_service.h"
#include "services/robot/robot_service.h"
#include "services/trigger/trigger_service.h"
#include "tests/line/rendered_cell.h"

namespace forgescan::testing {

// A service's place on the bus.
struct Host {
  Host(SimNetwork& network, const std::string& name)
      : bus(network.AddNode()), hub(bus, name), monitor(hub, name, "0") {}
  SimBus& bus;
  StreamHub hub;
  ServiceMonitor monitor;
};

// The image of one edge that a camera exposes but that never arrives.
struct LostFrame {
  int part = 0;
  int view = 0;
  int pattern = 0;
  bool right = false;
};

class SimLine {
 public:
  // The services as their programs make them from the station's folder, which `cell` has made; it outlives
  // the line. Results of an earlier line are removed. Errors: those of the services' configurations and
  // files.
  static Result<std::unique_ptr<SimLine>> Create(RenderedCell& cell, int parts, int first_part = 1);

  SimLine(const SimLine&) = delete;
  SimLine& operator=(const SimLine&) = delete;
  ~SimLine();  // and of its recordings

  void SetBusFaults(const SimFaults& faults) { network_.SetFaults(faults); }
  void LoseFrame(const LostFrame& frame) { lost_frame_ = frame; }
  RobotSim& robot() { return robot_; }
  LineSim& line() { return line_; }
  CoolingSim& cooling() { return cooling_; }

  // False if not every part was sorted within 70 s of simulated time a part.
  bool RunUntilSorted(int parts);
  // Until the trigger has said "captured" so often.
  bool RunUntilViews(std::size_t views);
  // Until so many images have been exposed, of both cameras and all parts.
  bool RunUntilExposed(int images);
  void RunFor(std::int64_t duration_us) { network_.RunFor(duration_us); }
  // Until a message has come on the channel, from VIEW_CLOUD to VERDICT.
  bool RunUntilPublished(const std::string& channel);

  // As SIGKILL ends a program: without a word, and with its files as they are. Only reconstruction, fusion,
  // registration and report.
  void Kill(const std::string& service);
  // A new process of one that was killed. Errors: as Create.
  Status StartAgain(const std::string& service);

  const std::vector<fsmsg::view_captured_t>& views() const { return views_; }
  const std::vector<fsmsg::scan_complete_t>& scans() const { return scans_; }
  const std::vector<fsmsg::verdict_t>& verdicts() const { return verdicts_; }
  const std::vector<fsmsg::part_sorted_t>& sorted() const { return sorted_; }
  // What the line's gate was told.
  const std::vector<LineCommand>& commands() const { return line_.sorted(); }
  // Every message from VIEW_CLOUD to VERDICT in order of arrival, with its channel before it.
  const std::vector<Bytes>& published() const { return published_; }
  // Closes the recordings, as SIGTERM does; returns their folder.
  std::string StopRecording();
  // Sums over all services.
  StreamCounters StreamTotals() const;
  std::int64_t Total(const std::string& counter) const;

 private:
  SimLine(RenderedCell& cell, const LineSimConfig& line);
  Host& At(const std::string& name) { return *hosts_.at(name); }
  Status MakeCellServices(const Station& station);
  Status MakeCamera(const Station& station, std::size_t side);
  Status MakeComputeServices(const Station& station);
  Status MakeRecorder(const Station& station);
  void Observe();
  void Record(const char* channel);
  void Expose(const TriggerSim::Edge& edge);

  RenderedCell& cell_;
  SimNetwork network_;
  RobotSim robot_;
  LineSim line_;
  TriggerSim trigger_;
  CoolingSim cooling_;
  std::array<std::unique_ptr<CameraSim>, 2> cameras_;  // left, right
  std::optional<LostFrame> lost_frame_;
  int exposed_ = 0;  // images

  std::map<std::string, std::unique_ptr<Host>> hosts_;
  std::unique_ptr<RobotService> robot_service_;
  std::unique_ptr<TriggerService> trigger_service_;
  std::unique_ptr<CoolingService> cooling_service_;
  std::array<std::unique_ptr<CameraService>, 2> camera_services_;
  std::map<std::string, std::shared_ptr<void>> compute_services_;  // reconstruction, fusion, ... report
  std::unique_ptr<RecorderService> recorder_service_;
  std::string recordings_;

  std::vector<fsmsg::view_captured_t> views_;
  std::vector<fsmsg::scan_complete_t> scans_;
  std::vector<fsmsg::verdict_t> verdicts_;
  std::vector<fsmsg::part_sorted_t> sorted_;
  std::vector<Bytes> published_;
};

}  // namespace forgescan::testing
