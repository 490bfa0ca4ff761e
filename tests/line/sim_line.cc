#include "tests/line/sim_line.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "services/common/bus/channels.h"
#include "services/common/model/bundle_file.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kPartPatienceUs = 70 * kSecondUs;  // takt 45 s, then what a lossy bus adds
constexpr std::int64_t kDispatchUs = 5'000;
constexpr std::int64_t kCameraClockUs[2] = {7'654'321, 1'234'567};  // ahead of the station's
constexpr double kRoundingDn = 0.29;                                // standard deviation of whole grey values

RobotSimConfig RobotOf(const RenderedCell& cell) {
  RobotSimConfig config;
  config.view_count = static_cast<std::uint16_t>(cell.view_count());
  config.path_crc32 = cell.path_crc32();
  return config;
}

LineSimConfig LineOf(int parts) {
  LineSimConfig config;
  config.parts = parts;
  return config;
}

RobotConfig RobotServiceOf(const RenderedCell& cell) {
  RobotConfig config;
  config.path_crc32 = cell.path_crc32();
  return config;
}

ReconstructionServiceConfig ReconstructionOf(const RenderedCell& cell) {
  ReconstructionServiceConfig config;
  config.reconstruction.noise = {std::hypot(cell.read_noise_dn(), kRoundingDn), cell.gain_dn()};
  config.publish_every_nth_point = 2;  // of a sixteenth of the pixels
  return config;
}

// The start may be off by the scatter of the parts: 8 mm and 1.5 degrees on each axis.
RegistrationConfig RegistrationOf() {
  RegistrationConfig config;
  config.icp.start_translation_mm = 16;
  return config;
}

}  // namespace

Result<std::unique_ptr<SimLine>> SimLine::Create(RenderedCell& cell, int parts) {
  std::unique_ptr<SimLine> line(new SimLine(cell, parts));
  RETURN_IF_ERROR(line->MakeServices());
  RETURN_IF_ERROR(line->MakeComputeServices());
  line->Observe();
  return line;
}

SimLine::SimLine(RenderedCell& cell, int parts) : cell_(cell), robot_(RobotOf(cell)), line_(LineOf(parts)) {
  for (const char* name : {"robot", "trigger", "cooling", "camera_left", "camera_right", "reconstruction",
                           "fusion", "registration", "report", "observer"}) {
    hosts_[name] = std::make_unique<Host>(network_, name);
  }
  CameraSimOptions camera;
  camera.width_px = cell.width_px();
  camera.height_px = cell.height_px();
  cameras_ = {std::make_unique<CameraSim>(camera), std::make_unique<CameraSim>(camera)};
  trigger_.SetEdgeHandler([this](const TriggerSim::Edge& edge) { Expose(edge); });
  line_.SetTemperature([this](std::uint32_t part, std::int64_t) {
    const auto view = cell_.View(static_cast<int>(part), robot_.status().view);
    return view.ok() ? (*view)->pyrometer_degc : std::nan("");
  });
}

Status SimLine::MakeServices() {
  TriggerConfig trigger;
  trigger.patterns = cell_.pattern_count();
  RETURN_IF_ERROR(trigger.Check());
  const auto at = [this](const char* name) -> Host& { return *hosts_.at(name); };
  robot_service_ = std::make_unique<RobotService>(
      at("robot").hub, at("robot").monitor, RobotService::Devices{robot_, line_}, RobotServiceOf(cell_));
  trigger_service_ =
      std::make_unique<TriggerService>(at("trigger").hub, at("trigger").monitor, trigger_, trigger);
  cooling_service_ =
      std::make_unique<CoolingService>(at("cooling").hub, at("cooling").monitor, cooling_, CoolingConfig{});
  for (const std::size_t side : {0u, 1u}) {
    Host& host = at(side == 0 ? "camera_left" : "camera_right");
    camera_services_[side] = std::make_unique<CameraService>(
        host.hub, host.monitor, *cameras_[side], CameraConfig{},
        side == 0 ? fsmsg::exposure_t::CAMERA_LEFT : fsmsg::exposure_t::CAMERA_RIGHT);
    host.bus.Every(kDispatchUs, [camera = cameras_[side].get()] { camera->Dispatch(); });
  }
  return {};
}

Status SimLine::MakeComputeServices() {
  const auto at = [this](const char* name) -> Host& { return *hosts_.at(name); };
  const fs::path folder = cell_.folder();
  ASSIGN_OR_RETURN(PatternSet pattern, LoadPatternSet(folder / "pattern.toml"));
  ASSIGN_OR_RETURN(StereoCalibration calibration,
                   LoadStereoCalibration((folder / "calibration" / "stereo.yaml").string()));
  reconstruction_service_ = std::make_unique<ReconstructionService>(
      at("reconstruction").hub, at("reconstruction").monitor, ReconstructionOf(cell_), std::move(pattern),
      std::move(calibration));
  ASSIGN_OR_RETURN(const SteelTable steel, cell_.Steel());
  FusionConfig fusion;
  fusion.reference_temperature_degc = cell_.reference_degc();
  ASSIGN_OR_RETURN(ExpansionCurve curve, ExpansionCurve::Create(steel.degc, steel.expansion));
  ASSIGN_OR_RETURN(ViewMatrices matrices, ViewMatrices::Load((folder / "views" / "views.toml").string()));
  fusion_service_ = std::make_unique<FusionService>(at("fusion").hub, at("fusion").monitor, fusion,
                                                    std::move(matrices), std::move(curve));
  ASSIGN_OR_RETURN(const ModelBundle bundle, ReadBundle(cell_.model_path()));
  ASSIGN_OR_RETURN(RegistrationModel model, RegistrationModel::Build(bundle));
  registration_service_ = std::make_unique<RegistrationService>(
      at("registration").hub, at("registration").monitor, RegistrationOf(), std::move(model));
  const fs::path results = folder / "results";
  std::error_code ignored;  // there may be none
  fs::remove_all(results, ignored);
  ASSIGN_OR_RETURN(evaluator_, ModelEvaluator::Load(cell_.model_path(), folder / "model" / "features.toml"));
  ASSIGN_OR_RETURN(report_service_,
                   ReportService::Create(at("report").hub, at("report").monitor, ReportConfig{},
                                         {"line_test", "0", "0", results.string()}, *evaluator_));
  return {};
}

void SimLine::Observe() {
  StreamHub& hub = hosts_.at("observer")->hub;
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
  hosts_.at("observer")->bus.Subscribe(name, [this, name](ByteView message) {
    published_.emplace_back(name.begin(), name.end());
    published_.emplace_back(message.begin(), message.end());
  });
}

// What the cameras see at an edge: the view the robot holds, of the part in place.
void SimLine::Expose(const TriggerSim::Edge& edge) {
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
