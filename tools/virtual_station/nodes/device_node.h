// A simulated device on the CAN bus: the device's side of a Protocol, in front of the device's simulation.
#pragma once

#include "drivers/canopen/canopen_node.h"
#include "drivers/cooling/cooling_canopen.h"
#include "drivers/cooling/cooling_sim.h"
#include "drivers/line/line_canopen.h"
#include "drivers/line/line_sim.h"
#include "drivers/robot/robot_canopen.h"
#include "drivers/robot/robot_sim.h"
#include "drivers/trigger/trigger_canopen.h"
#include "drivers/trigger/trigger_sim.h"

namespace forgescan {

struct NodeFaults {
  bool silent = false;  // neither sends nor hears: power lost, cable cut
};

// Faults of the device itself are switched at its simulation.
template <typename Protocol, typename Simulation>
class DeviceNode {
 public:
  // Bus and simulation must live as long as the node, and the node as long as the bus is drained.
  DeviceNode(CanBus& bus, Simulation& device) : bus_(bus), device_(device), canopen_(Protocol::kNode) {
    bus_.AddHandler([this](const CanFrame& frame) { OnFrame(frame); });
    device_.SetHandler([this](const typename Protocol::Event& event) { OnEvent(event); });
  }

  // Call every few milliseconds of simulated time, after the bus was drained.
  void Step(std::int64_t now_us) {
    StepWire(now_us);
    device_.Step(now_us);
  }
  // The bus side alone: the node is powered up and answers, the device behind it has not been started.
  void StepWire(std::int64_t now_us) {
    if (!faults_.silent) {
      SendAll(canopen_.Step(now_us));
    }
  }

  void SetFaults(const NodeFaults& faults) { faults_ = faults; }
  void Restart() { canopen_ = WithObjects(canopen::CanopenNode(Protocol::kNode)); }
  std::uint64_t bad_frames() const { return bad_frames_; }
  std::uint64_t unsent_frames() const { return unsent_frames_; }

 private:
  void OnFrame(const CanFrame& frame) {
    if (faults_.silent || frame.error) {
      return;
    }
    SendAll(canopen_.OnFrame(frame));
    const auto command = protocol_.CommandOf(frame);
    const bool wanted = command.ok() && command->has_value() && canopen_.operational();
    if (!command.ok() || (wanted && !device_.Send(**command).ok())) {
      ++bad_frames_;
    }
  }

  void OnEvent(const typename Protocol::Event& event) {
    for (const auto& [address, entry] : protocol_.ObjectsOf(event)) {
      objects_[address] = entry;
      canopen_.SetObject(address, entry);
    }
    if (faults_.silent || !canopen_.operational()) {
      return;
    }
    if (const auto* fault = std::get_if<DeviceFault>(&event)) {
      const std::uint8_t error_register = fault->code == canopen::kNoError ? 0 : 1;
      SendAll({canopen::EmergencyFrame(Protocol::kNode, {fault->code, error_register, fault->detail})});
      return;
    }
    const auto frames = protocol_.FramesOf(event);
    frames.ok() ? SendAll(*frames) : static_cast<void>(++unsent_frames_);
  }

  void SendAll(const std::vector<CanFrame>& frames) {
    for (const CanFrame& frame : frames) {
      if (!bus_.Send(frame).ok()) {
        ++unsent_frames_;  // a device has nobody to tell
      }
    }
  }

  canopen::CanopenNode WithObjects(canopen::CanopenNode node) const {
    for (const auto& [address, entry] : objects_) {
      node.SetObject(address, entry);
    }
    return node;
  }

  CanBus& bus_;
  Simulation& device_;
  Protocol protocol_;
  canopen::CanopenNode canopen_;
  std::map<canopen::ObjectAddress, canopen::ObjectEntry> objects_;
  NodeFaults faults_;
  std::uint64_t bad_frames_ = 0;
  std::uint64_t unsent_frames_ = 0;
};

using RobotNode = DeviceNode<RobotProtocol, RobotSim>;
using TriggerNode = DeviceNode<TriggerProtocol, TriggerSim>;
using CoolingNode = DeviceNode<CoolingProtocol, CoolingSim>;
using LineNode = DeviceNode<LineProtocol, LineSim>;

}  // namespace forgescan
