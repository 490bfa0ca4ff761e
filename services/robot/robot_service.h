// The robot service: the line's signals and the robot's path on one side, the choreography's messages on the
// other.
#pragma once

#include "services/common/aged_map.h"
#include "services/common/bus/channels.h"
#include "services/common/service/service_monitor.h"
#include "services/robot/robot_machine.h"
#include "services/robot/sort_machine.h"

namespace forgescan {

class RobotService {
 public:
  struct Devices {
    Robot& robot;
    LineSignals& line;
  };

  // Hub, monitor and devices must live as long as the service. The caller drains their bus. `config` passed
  // Check().
  RobotService(StreamHub& hub, ServiceMonitor& monitor, const Devices& devices, const RobotConfig& config);
  RobotService(const RobotService&) = delete;
  RobotService& operator=(const RobotService&) = delete;
  ~RobotService();

 private:
  std::int64_t Now() const { return hub_.bus().NowUs(); }
  void Subscribe();
  void Step();
  void OnRobot(const RobotEvent& event);
  void OnLine(const LineEvent& event);
  void OnVerdict(const fsmsg::verdict_t& verdict);
  void WatchCooling();
  void OnRecorder(const fsmsg::recorder_state_t& recorder);
  void WatchRecorder();
  void Do(const RobotMachine::Actions& actions);
  void Do(const RobotCommand& command) { Note(devices_.robot.Send(command)); }
  void Do(const PartStarted& start);
  void Do(const ViewSettled& view);
  void Do(const ScanFinished& scan);
  void Do(const ViewTemperature& view);
  void Do(const RobotNote& note);
  void DoSort(const SortMachine::Actions& actions);
  void PublishSorted(const PartSorted& sorted);
  void PublishPath();
  void ShowState();
  void Note(const Status& status);

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  Devices devices_;
  RobotConfig config_;
  RobotMachine machine_;
  SortMachine sorter_;
  AgedMap<std::int32_t, std::int64_t> arrived_us_{16};  // by part; more are not in the cell
  RobotStatus status_;
  double body_degc_;
  double part_degc_;
  std::int64_t last_cooling_us_ = 0;
  std::int64_t last_recorder_us_ = 0;
  std::string shown_;
  Bus::TimerId timer_;
};

}  // namespace forgescan
