#include "tests/line/sim_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "services/common/bus/channels.h"
#include "services/fusion/make_fusion_service.h"
#include "services/reconstruction/make_reconstruction_service.h"
#include "services/registration/make_registration_service.h"
#include "services/report/make_report_service.h"

namespace forgescan::testing {
namespace {

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kPartPatienceUs = 70 * kSecondUs;  // takt 45 s, then what a lossy bus adds
constexpr std::int64_t kDispatchUs = 5'000;
constexpr std::int64_t kCameraClockUs[2] = {7'654'321, 1'234'567};  // ahead of the station's

RobotSimConfig RobotOf(const RenderedCell& cell) {
  RobotSimConfig config;
  config.view_count = static_cast<std::uint16_t>(cell.view_count());
  config.path_crc32 = cell.path_crc32();
  return config;
}

LineSimConfig LineOf(int parts, int first_part) {
  LineSimConfig config;
  config.first_part = static_cast<std::uint32_t>(first_part);
  config.parts = parts;
  return config;
}

// A folder of its own for every line.
std::filesystem::path MakeRecordings(const RenderedCell& cell) {
  int line = 0;
  std::filesystem::path folder;
  do {
    folder = cell.folder() / ("recordings-" + std::to_string(++line));
  } while (!std::filesystem::create_directory(folder));
  return folder;
}

struct Maker {
  const char* name;
  Result<std::shared_ptr<void>> (*make)(const ServiceParts&);
};
constexpr Maker kMakers[] = {{"reconstruction", MakeReconstructionService},
                             {"fusion", MakeFusionService},
                             {"registration", MakeRegistrationService},
                             {"report", MakeReportService}};

}  // namespace

Result<std::unique_ptr<SimLine>> SimLine::Create(RenderedCell& cell, int parts, int first_part) {
  std::unique_ptr<SimLine> line(new SimLine(cell, LineOf(parts, first_part)));
  ASSIGN_OR_RETURN(const Station station, Station::Load(cell.folder().string()));
  RETURN_IF_ERROR(line->MakeRecorder(station));
  RETURN_IF_ERROR(line->MakeCellServices(station));
  RETURN_IF_ERROR(line->MakeCamera(station, 0));
  RETURN_IF_ERROR(line->MakeCamera(station, 1));
  RETURN_IF_ERROR(line->MakeComputeServices(station));
  line->Observe();
  return line;
}

SimLine::SimLine(RenderedCell& cell, const LineSimConfig& line)
    : cell_(cell), robot_(RobotOf(cell)), line_(line) {
  for (const char* name : {"robot", "trigger", "cooling", "camera_left", "camera_right", "reconstruction",
                           "fusion", "registration", "report", "recorder", "observer"}) {
    hosts_[name] = std::make_unique<Host>(network_, name);
  }
  CameraSimOptions camera;
  camera.exposure_us = TriggerConfig{}.exposure_us;  // as the station orders it
  camera.width_px = cell.width_px();
  camera.height_px = cell.height_px();
  cameras_ = {std::make_unique<CameraSim>(camera), std::make_unique<CameraSim>(camera)};
  trigger_.SetEdgeHandler([this](const TriggerSim::Edge& edge) { Expose(edge); });
  line_.SetTemperature([this](std::uint32_t part, std::int64_t) {
    const auto view = cell_.View(static_cast<int>(part), robot_.status().view);
    return view.ok() ? (*view)->pyrometer_degc : std::nan("");
  });
}

Status SimLine::MakeCellServices(const Station& station) {
  ASSIGN_OR_RETURN(const auto robot, RobotConfig::Load(station.file.Table("robot")));
  ASSIGN_OR_RETURN(const auto trigger, TriggerConfig::Load(station.file.Table("trigger")));
  ASSIGN_OR_RETURN(const auto cooling, CoolingConfig::Load(station.file.Table("cooling")));
  robot_service_ = std::make_unique<RobotService>(At("robot").hub, At("robot").monitor,
                                                  RobotService::Devices{robot_, line_}, robot);
  trigger_service_ =
      std::make_unique<TriggerService>(At("trigger").hub, At("trigger").monitor, trigger_, trigger);
  cooling_service_ =
      std::make_unique<CoolingService>(At("cooling").hub, At("cooling").monitor, cooling_, cooling);
  return {};
}

Status SimLine::MakeCamera(const Station& station, std::size_t side) {
  const std::string name = side == 0 ? "left" : "right";
  ASSIGN_OR_RETURN(const CameraConfig config, CameraConfig::Load(station.file.Table("camera"), name));
  Host& host = *hosts_.at("camera_" + name);
  camera_services_[side] = std::make_unique<CameraService>(
      host.hub, host.monitor, *cameras_[side], config,
      side == 0 ? fsmsg::exposure_t::CAMERA_LEFT : fsmsg::exposure_t::CAMERA_RIGHT);
  host.bus.Every(kDispatchUs, [camera = cameras_[side].get()] { camera->Dispatch(); });
  return {};
}

Status SimLine::MakeComputeServices(const Station& station) {
  std::error_code ignored;  // there may be none
  std::filesystem::remove_all(station.results, ignored);
  for (const auto& [name, make] : kMakers) {
    ASSIGN_OR_RETURN(compute_services_[name], make({station, At(name).hub, At(name).monitor}));
  }
  return {};
}

void SimLine::Kill(const std::string& service) {
  const auto station = Station::Load(cell_.folder().string());
  ASSERT_TRUE(station.ok()) << station.error().message;
  const std::filesystem::path results = station->results, kept = station->results + "-kept";
  std::filesystem::copy(results, kept, std::filesystem::copy_options::recursive);
  SimBus& bus = At(service).bus;
  bus.SetSendFilter([](std::string_view, ByteView) { return false; });
  compute_services_.erase(service);
  hosts_.erase(service);
  network_.RemoveNode(bus);
  if (service == "report") {  // what its end wrote; the others write nothing
    std::filesystem::remove_all(results);
    std::filesystem::rename(kept, results);
  }
  std::filesystem::remove_all(kept);
}

Status SimLine::StartAgain(const std::string& service) {
  ASSIGN_OR_RETURN(const Station station, Station::Load(cell_.folder().string()));
  hosts_[service] = std::make_unique<Host>(network_, service);
  const auto maker = std::find_if(std::begin(kMakers), std::end(kMakers),
                                  [&service](const auto& known) { return known.name == service; });
  ASSIGN_OR_RETURN(compute_services_[service], maker->make({station, At(service).hub, At(service).monitor}));
  return {};
}

Status SimLine::MakeRecorder(const Station& station) {
  ASSIGN_OR_RETURN(RecorderConfig config, RecorderConfig::Load(station.file.Table("recorder")));
  config.folder = recordings_ = MakeRecordings(cell_);
  ASSIGN_OR_RETURN(std::vector<StationFile> files, StationFilesOf(station));
  ASSIGN_OR_RETURN(recorder_service_,
                   RecorderService::Create(At("recorder").hub, At("recorder").monitor, config,
                                           {station.name, "0", "", station.file.hash(), std::move(files)}));
  recorder_service_->Drain();  // it records before the first part comes, however short that is in real time
  return {};
}

std::string SimLine::StopRecording() {
  recorder_service_.reset();
  return recordings_;
}

SimLine::~SimLine() {
  recorder_service_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(recordings_, ignored);
}

void SimLine::Observe() {
  StreamHub& hub = At("observer").hub;
  hub.Subscribe<fsmsg::view_captured_t>(kViewCaptured, [this](const auto& m) { views_.push_back(m); });
  hub.Subscribe<fsmsg::scan_complete_t>(kScanComplete, [this](const auto& m) { scans_.push_back(m); });
  hub.Subscribe<fsmsg::verdict_t>(kVerdict, [this](const auto& m) { verdicts_.push_back(m); });
  hub.Subscribe<fsmsg::part_sorted_t>(kPartSorted, [this](const auto& m) { sorted_.push_back(m); });
  for (const char* channel : {kViewCloud.name, kViewResult.name, kFusedCloud.name, kFusionResult.name,
                              kRegisteredCloud.name, kRegistration.name, kVerdict.name}) {
    Record(channel);
  }
}

void SimLine::Record(const char* channel) {
  const std::string name = channel;
  At("observer").bus.Subscribe(name, [this, name](ByteView message) {
    published_.emplace_back(name.begin(), name.end());
    published_.emplace_back(message.begin(), message.end());
  });
}

// What the cameras see at an edge: the view the robot holds, of the part in place.
void SimLine::Expose(const TriggerSim::Edge& edge) {
  ++exposed_;
  const int part = static_cast<int>(line_.part().part);
  const auto view = cell_.View(part, edge.view);
  ASSERT_TRUE(view.ok()) << view.error().message;
  const std::size_t side = edge.right ? 1 : 0;
  CameraSim& camera = *cameras_[side];
  const bool lost = lost_frame_.has_value() && lost_frame_->part == part && lost_frame_->view == edge.view &&
                    lost_frame_->pattern == edge.pattern && lost_frame_->right == edge.right;
  camera.SetFaults({.lost_frame_chance = lost ? 1.0 : 0.0});
  const Status fired = camera.Trigger(edge.utime + kCameraClockUs[side], (*view)->images[side][edge.pattern]);
  ASSERT_TRUE(fired.ok()) << fired.error().message;
}

bool SimLine::RunUntilSorted(int parts) {
  const auto sorted = static_cast<std::size_t>(parts);
  return network_.RunUntilTrue([&] { return sorted_.size() >= sorted; }, parts * kPartPatienceUs);
}

bool SimLine::RunUntilViews(std::size_t views) {
  return network_.RunUntilTrue([&] { return views_.size() >= views; }, kPartPatienceUs);
}

bool SimLine::RunUntilExposed(int images) {
  return network_.RunUntilTrue([&] { return exposed_ >= images; }, 3 * kPartPatienceUs);
}

bool SimLine::RunUntilPublished(const std::string& channel) {
  const Bytes name(channel.begin(), channel.end());
  return network_.RunUntilTrue(
      [&, from = published_.size()] {
        return std::find(published_.begin() + static_cast<std::ptrdiff_t>(from), published_.end(), name) !=
               published_.end();
      },
      kPartPatienceUs);
}

StreamCounters SimLine::StreamTotals() const {
  StreamCounters total;
  for (const auto& [name, host] : hosts_) {
    const StreamCounters& counters = host->hub.counters();
    total.published += counters.published;
    total.delivered += counters.delivered;
    total.missing += counters.missing;
    total.recovered += counters.recovered;
    total.resent += counters.resent;
    total.duplicates += counters.duplicates;
    total.damaged += counters.damaged;
  }
  return total;
}

std::int64_t SimLine::Total(const std::string& counter) const {
  std::int64_t total = 0;
  for (const auto& [name, host] : hosts_) {
    total += host->monitor.counter(counter);
  }
  return total;
}

}  // namespace forgescan::testing
