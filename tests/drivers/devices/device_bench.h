// DeviceBench: one device with its simulation, called directly or with the real driver and an in-process CAN
// bus between.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "drivers/can/can_inprocess.h"
#include "tools/virtual_station/nodes/device_node.h"

namespace forgescan {

// In simulated time, in steps of 1 ms.
template <typename Protocol, typename Simulation>
class DeviceBench {
 public:
  static constexpr std::int64_t kStep_us = 1000;
  using Command = typename Protocol::Command;
  using Event = typename Protocol::Event;

  template <typename Config>
  DeviceBench(bool over_can, const Config& config) : simulation_(config) {
    if (over_can) {
      host_bus_ = wire_.Attach();
      node_bus_ = wire_.Attach();
      node_.emplace(*node_bus_, simulation_);
      host_ = std::make_unique<CanopenHost<Protocol>>(*host_bus_);
    }
    device().SetHandler([this](const Event& event) { events.push_back(event); });
  }

  Device<Command, Event>& device() {
    return host_ ? *host_ : static_cast<Device<Command, Event>&>(simulation_);
  }
  Simulation& simulation() { return simulation_; }
  InProcessCan& wire() { return wire_; }
  DeviceNode<Protocol, Simulation>& node() { return *node_; }

  void RunFor(std::int64_t duration_us) {
    const std::int64_t end_us = now_us + duration_us;
    for (; now_us < end_us; now_us += kStep_us) {
      wire_.StepTo(now_us);
      if (!host_) {
        simulation_.Step(now_us);
        continue;
      }
      EXPECT_TRUE(node_bus_->Drain().ok());
      node_->Step(now_us);
      EXPECT_TRUE(host_bus_->Drain().ok());
      host_->Step(now_us);
    }
  }

  template <typename T>
  std::vector<T> All() const {
    std::vector<T> found;
    for (const Event& event : events) {
      if (const T* one = std::get_if<T>(&event)) {
        found.push_back(*one);
      }
    }
    return found;
  }
  template <typename T>
  T Last() const {
    const auto all = All<T>();
    EXPECT_FALSE(all.empty());
    return all.empty() ? T{} : all.back();
  }

  std::vector<Event> events;
  std::int64_t now_us = 1'000'000;

 private:
  Simulation simulation_;
  InProcessCan wire_{{}, 1'000'000};
  std::unique_ptr<CanBus> host_bus_, node_bus_;
  std::optional<DeviceNode<Protocol, Simulation>> node_;
  std::unique_ptr<CanopenHost<Protocol>> host_;
};

using RobotBench = DeviceBench<RobotProtocol, RobotSim>;
using TriggerBench = DeviceBench<TriggerProtocol, TriggerSim>;
using CoolingBench = DeviceBench<CoolingProtocol, CoolingSim>;
using LineBench = DeviceBench<LineProtocol, LineSim>;

}  // namespace forgescan
