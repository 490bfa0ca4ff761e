// The robot service: the line's signals and the robot's path on one side, the choreography's messages on the
// other.
#pragma once

#include "services/common/bus/channels.h"
#include "services/common/service/service_monitor.h"
#include "services/robot/part_memory.h"
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
  // Check(). `memory_path`: of the file by which a service started again knows the last parts; empty = none.
  RobotService(StreamHub& hub, ServiceMonitor& monitor, const Devices& devices, const RobotConfig& config,
               const std::string& memory_path = "");
  RobotService(const RobotService&) = delete;
  RobotService& operator=(const RobotService&) = delete;
  // Ends a scan that is under way, with a word on SCAN_COMPLETE.
  ~RobotService();

 private:
  std::int64_t Now() const { return hub_.bus().NowUs(); }
  void Subscribe();
  // Takes up what the service before this one left: its scan is at an end, its part is not scanned again.
  void Resume();
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
  PartMemory memory_;
  RobotStatus status_;
  double body_degc_;
  double part_degc_;
  std::int64_t last_cooling_us_ = 0;
  std::int64_t last_recorder_us_ = 0;
  std::string shown_;
  Bus::TimerId timer_;
};

}  // namespace forgescan
