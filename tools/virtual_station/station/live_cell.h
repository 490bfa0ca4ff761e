// The cell in real time: parts that arrive, a robot that moves, pulses that fire cameras, a cooling circuit.
// To the services it is a CAN bus and two GigE Vision cameras.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "drivers/can/can_bus.h"
#include "tools/virtual_station/gige/gige_device.h"
#include "tools/virtual_station/nodes/device_node.h"
#include "tools/virtual_station/station/view_renderer.h"

namespace forgescan {

struct LiveCellOptions {
  std::string can_url;
  std::array<std::string, 2> camera_address;  // left, right
  std::string truth_folder;                   // one file a part
  int parts = 1;                              // 0 = for ever
  double link_mbit_s = 1000;                  // into the host, shared by both cameras
  double takt_s = 45.0;
};

class LiveCell {
 public:
  // Errors: kUnavailable, kIo (no CAN bus, a camera's address is taken), kInvalidArgument.
  static Result<std::unique_ptr<LiveCell>> Create(CellConfig config, const LiveCellOptions& options);
  ~LiveCell();

  // The line begins to deliver parts; before, the cell is powered up and idle.
  void StartLine() { line_started_ = true; }
  // Lets a millisecond pass. Errors: as the renderer's and the truth's.
  Status Step();

 private:
  LiveCell(CellConfig config, LiveCellOptions options, std::unique_ptr<CanBus> can);
  Status CreateCameras(const CellConfig& config);
  // Seconds since the part had its start temperature, on the cell's thermal clock.
  double PartAge() const;
  double PartTemperature(std::uint32_t part) const;
  void FollowLine();
  void FollowRobot(std::int64_t elapsed_us);
  // The latest visit of a view of the part in place.
  ViewVisit LatestVisit(int view) const;
  Status FollowSorting();
  void OnEdge(const TriggerSim::Edge& edge);
  std::shared_ptr<const GreyImage> ImageOf(std::uint64_t tag) const;

  LiveCellOptions options_;
  VirtualCell cell_;
  ViewRenderer renderer_;
  std::unique_ptr<CanBus> can_;
  RobotSim robot_;
  TriggerSim trigger_;
  CoolingSim cooling_;
  LineSim line_;
  RobotNode robot_node_;
  TriggerNode trigger_node_;
  CoolingNode cooling_node_;
  LineNode line_node_;
  std::array<std::unique_ptr<GigeDevice>, 2> cameras_;  // after renderer_: their threads ask it for images

  bool line_started_ = false;
  std::int64_t now_us_ = 0;
  int part_ = 0;  // in place, 0 = none yet
  std::int64_t in_place_us_ = 0;
  std::int64_t held_us_ = 0;                       // the thermal clock stood still: the renderer was behind
  std::optional<std::uint16_t> followed_order_;    // of the robot: the last whose view was requested
  std::map<int, int> visits_;                      // by view of part_: how often the robot went there
  std::map<int, std::map<int, ViewState>> taken_;  // by part and view: as rendered
  std::size_t sorted_ = 0;
  std::set<int> truth_due_;  // parts that were sorted and whose truth is not written
};

}  // namespace forgescan
