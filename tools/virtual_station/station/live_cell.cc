#include "tools/virtual_station/station/live_cell.h"

#include <poll.h>

#include <ctime>
#include <filesystem>
#include <utility>

#include "drivers/can/open_can_bus.h"
#include "tools/virtual_station/station_writer.h"
#include "tools/virtual_station/truth.h"

namespace forgescan {
namespace {

constexpr int kStepMs = 1;
// From the robot's order to the middle of the exposures: what is not the move itself.
constexpr double kSettleAndHalfCaptureS = 0.75;
constexpr double kPartHeatLoadW = 60.0;
constexpr std::int64_t kTransportUs = 1'500'000;  // one part out, the next in

// The edge's time base: the cameras stamp with it.
std::int64_t MonotonicUs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000 + now.tv_nsec / 1000;
}

constexpr int kVisits = 128;  // that a tag tells apart

// Bits: part 32, view 16, visit 7, side 1, pattern 8.
std::uint64_t TagOf(const ViewVisit& visit, const TriggerSim::Edge& edge) {
  return static_cast<std::uint64_t>(visit.part) << 32 | static_cast<std::uint64_t>(visit.view) << 16 |
         static_cast<std::uint64_t>(visit.visit) << 9 | static_cast<std::uint64_t>(edge.right ? 1 : 0) << 8 |
         edge.pattern;
}

ViewVisit VisitOf(std::uint64_t tag) {
  return {static_cast<int>(tag >> 32), static_cast<int>(tag >> 16 & 0xffff),
          static_cast<int>(tag >> 9 & 0x7f)};
}

RobotSimConfig RobotOf(const CellConfig& config) {
  RobotSimConfig robot;
  robot.view_count = static_cast<std::uint16_t>(config.views.size());
  robot.path_crc32 = PathCrc32(config.views);
  robot.move_timeout_ms = 30'000;  // a picture may be late on a small machine; the arm is held for it
  return robot;
}

LineSimConfig LineOf(const LiveCellOptions& options) {
  LineSimConfig line;
  line.takt_us = static_cast<std::int64_t>(options.takt_s * 1e6);
  line.dwell_us = line.takt_us - kTransportUs;
  line.parts = options.parts;
  return line;
}

}  // namespace

Result<std::unique_ptr<LiveCell>> LiveCell::Create(CellConfig config, const LiveCellOptions& options) {
  ASSIGN_OR_RETURN(auto can, OpenCanBus(options.can_url, MonotonicUs));
  const CellConfig kept = config;
  std::unique_ptr<LiveCell> cell(new LiveCell(std::move(config), options, std::move(can)));
  RETURN_IF_ERROR(cell->CreateCameras(kept));
  return cell;
}

LiveCell::LiveCell(CellConfig config, LiveCellOptions options, std::unique_ptr<CanBus> can)
    : options_(std::move(options)),
      cell_(std::move(config), 2),
      renderer_(cell_, ProjectedSet::kReduced),
      can_(std::move(can)),
      robot_(RobotOf(cell_.config())),
      line_(LineOf(options_)),
      robot_node_(*can_, robot_),
      trigger_node_(*can_, trigger_),
      cooling_node_(*can_, cooling_),
      line_node_(*can_, line_) {
  trigger_.SetEdgeHandler([this](const TriggerSim::Edge& edge) { OnEdge(edge); });
  line_.SetTemperature([this](std::uint32_t part, std::int64_t) { return PartTemperature(part); });
}

LiveCell::~LiveCell() = default;

Status LiveCell::CreateCameras(const CellConfig& config) {
  const auto link = std::make_shared<Link>(LinkOptions{.rate_mbit_s = options_.link_mbit_s});
  for (std::size_t side = 0; side < cameras_.size(); ++side) {
    const PinholeCamera& camera = side == 0 ? config.rig.left : config.rig.right;
    GigeDeviceConfig device;
    device.address = options_.camera_address[side];
    device.mac += side;
    device.serial = std::to_string(side + 1);
    device.user_name = side == 0 ? "left" : "right";
    device.width_px = camera.width_px;
    device.height_px = camera.height_px;
    device.link = link;
    device.seed = config.seed + side;
    device.image = [this](std::uint64_t tag) { return ImageOf(tag); };
    ASSIGN_OR_RETURN(cameras_[side], GigeDevice::Create(std::move(device)));
  }
  return {};
}

double LiveCell::PartAge() const {
  return cell_.config().heat.first_view_s + static_cast<double>(now_us_ - in_place_us_ - held_us_) * 1e-6;
}

double LiveCell::PartTemperature(std::uint32_t part) const {
  const auto state = renderer_.Part(static_cast<int>(part));
  const HeatConfig& heat = cell_.config().heat;
  const auto degc =
      state != nullptr ? TemperatureAfter(heat.law, state->start_degc, PartAge()) : Result<double>(0.0);
  if (!degc.ok() || state == nullptr) {
    return 0.0;  // no hot part in sight
  }
  RandomStream noise(cell_.config().seed, RandomUse::kPyrometer,
                     {static_cast<int>(part), static_cast<int>(now_us_ / 1000)});
  return Pyrometer{state->pyrometer_bias_k, heat.pyrometer_noise_sd_k}.Read(*degc, noise);
}

void LiveCell::FollowLine() {
  const LinePart& part = line_.part();
  if (part.in_place && static_cast<int>(part.part) != part_) {
    part_ = static_cast<int>(part.part);
    in_place_us_ = now_us_;
    held_us_ = 0;
    followed_order_.reset();
    visits_.clear();
    renderer_.PreparePart(part_);
    renderer_.PreparePart(part_ + 1);
  }
  cooling_.SetHeatLoad(part.in_place ? kPartHeatLoadW : 0.0);
}

void LiveCell::FollowRobot(std::int64_t elapsed_us) {
  const RobotStatus& status = robot_.status();
  const int view = status.view;
  if (status.state != RobotState::kMoving || part_ == 0 ||
      view >= static_cast<int>(cell_.config().views.size())) {
    return;
  }
  // Every order to go to a view is another visit, also to where the robot is. A move home from a view before
  // the last looks the same; its picture is made for nothing.
  if (status.seq_echo != followed_order_) {
    followed_order_ = status.seq_echo;
    ++visits_[view];
    const double move_s = static_cast<double>(RobotSimConfig().move_us) * 1e-6;
    renderer_.Request(LatestVisit(view), PartAge() + move_s + kSettleAndHalfCaptureS);
  }
  const auto rendered = renderer_.Find(LatestVisit(view));
  // The arm is held just short of the view while its picture is not there.
  robot_.SetFaults({.stuck = rendered == nullptr});
  if (rendered == nullptr && robot_.progress() >= 1.0) {
    held_us_ += elapsed_us;
    line_.HoldParts(elapsed_us);
  }
}

ViewVisit LiveCell::LatestVisit(int view) const {
  const auto found = visits_.find(view);
  return {part_, view, found == visits_.end() ? 0 : (found->second - 1) % kVisits};
}

Status LiveCell::FollowSorting() {
  for (; sorted_ < line_.sorted().size(); ++sorted_) {
    const std::uint32_t part = line_.sorted()[sorted_].part;
    if (part >= 1 && part <= static_cast<std::uint32_t>(part_)) {  // others never were here
      truth_due_.insert(static_cast<int>(part));
    }
  }
  for (auto due = truth_due_.begin(); due != truth_due_.end();) {
    const int part = *due;
    const auto state = renderer_.Part(part);
    if (state == nullptr) {  // sorted before the renderer has prepared it
      ++due;
      continue;
    }
    due = truth_due_.erase(due);
    std::vector<ViewState> views;
    for (const auto& [view, taken] : taken_[part]) {
      views.push_back(taken);
    }
    taken_.erase(part);
    const std::string name = fmt::format("part_{:06}.json", part);
    RETURN_IF_ERROR(WriteTruth(cell_.config(), *state, views,
                               (std::filesystem::path(options_.truth_folder) / name).string()));
  }
  return {};
}

void LiveCell::OnEdge(const TriggerSim::Edge& edge) {
  const ViewVisit visit = LatestVisit(edge.view);
  if (const auto rendered = renderer_.Find(visit); rendered != nullptr) {
    taken_[part_].insert_or_assign(edge.view, rendered->state);
  }
  cameras_[edge.right ? 1 : 0]->Edge(edge.utime * 1000, TagOf(visit, edge));
}

std::shared_ptr<const GreyImage> LiveCell::ImageOf(std::uint64_t tag) const {
  const auto rendered = renderer_.Find(VisitOf(tag));
  const auto pattern = static_cast<std::size_t>(tag & 0xff);
  const auto side = static_cast<std::size_t>(tag >> 8 & 1);
  return rendered != nullptr && pattern < rendered->images[side].size() ? rendered->images[side][pattern]
                                                                        : nullptr;
}

Status LiveCell::Step() {
  pollfd waiting{can_->fd(), POLLIN, 0};
  poll(&waiting, 1, kStepMs);
  const std::int64_t before_us = std::exchange(now_us_, MonotonicUs());
  RETURN_IF_ERROR(can_->Drain());
  robot_node_.Step(now_us_);
  trigger_node_.Step(now_us_);
  cooling_node_.Step(now_us_);
  line_node_.StepWire(now_us_);
  if (line_started_) {
    line_.Step(now_us_);
    FollowLine();
  }
  FollowRobot(now_us_ - before_us);
  RETURN_IF_ERROR(FollowSorting());
  return renderer_.status();
}

}  // namespace forgescan
