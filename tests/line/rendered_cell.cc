#include "tests/line/rendered_cell.h"

#include <unistd.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>
#include <string_view>

#include "services/common/model/bundle_file.h"
#include "services/common/model/model_import.h"
#include "tools/forgescan/standing/empty_cell.h"
#include "tools/virtual_station/commissioning.h"
#include "tools/virtual_station/station_writer.h"
#include "tools/virtual_station/virtual_cell.h"
#include "tools/virtual_station/whole_file.h"

namespace forgescan::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kScaleDivisor = 4;
constexpr int kThreads = 2;
constexpr double kOutOfSightMm = 30'000;
// Of a sixteenth of the pixels, more points are kept.
constexpr std::string_view kThinning = "publish_every_nth_point = 8";
constexpr std::string_view kThinningOfSmallImages = "publish_every_nth_point = 2";
// The posts are narrow: a cell of theirs needs every point.
constexpr std::string_view kNoThinning = "publish_every_nth_point = 1";
const fs::path kStation = FORGESCAN_SOURCE_DIR "/stations/virtual";

// Both keys, whatever their values are.
std::string WithoutStanding(const std::string& station) {
  return std::regex_replace(station, std::regex("\n(standing|robot_shift_mm|robot_turn_rad) = [^\n]*"), "");
}

Status WriteFiles(const CellConfig& config, const fs::path& folder, StandingPosts posts) {
  RETURN_IF_ERROR(WriteStation(config, ProjectedSet::kReduced, folder.string()));
  std::stringstream station;
  station << std::ifstream(kStation / "station.toml").rdbuf();
  ASSIGN_OR_RETURN(std::string commissioned, CommissionedStation(config, station.str()));
  const std::size_t thinning = commissioned.find(kThinning);
  if (thinning == std::string::npos) {
    return Fail(ErrorCode::kNotFound, "{}: \"{}\" is not in it", kStation.string(), kThinning);
  }
  const bool used = posts == StandingPosts::kUsed;
  commissioned.replace(thinning, kThinning.size(), used ? kNoThinning : kThinningOfSmallImages);
  RETURN_IF_ERROR(WriteWholeFile((folder / "station.toml").string(),
                                 used ? commissioned : WithoutStanding(commissioned)));
  RETURN_IF_ERROR(WriteStandingOf(config, folder.string(), kThreads));
  ASSIGN_OR_RETURN(const ModelBundle model, LoadModel(folder / "model" / "axle.step", {}));
  return WriteBundle(model, folder / "model" / "axle.bundle");
}

}  // namespace

struct RenderedCell::Cell {
  explicit Cell(CellConfig config)
      : cell(std::move(config), kThreads), patterns(cell.Patterns(ProjectedSet::kReduced)) {}
  VirtualCell cell;
  std::vector<Pattern> patterns;
};

RenderedCell::RenderedCell(std::unique_ptr<Cell> cell, fs::path folder)
    : cell_(std::move(cell)), folder_(std::move(folder)) {}

RenderedCell::~RenderedCell() {
  std::error_code ignored;  // a folder that cannot be removed is no failure of a test
  fs::remove_all(folder_, ignored);
}

Result<std::unique_ptr<RenderedCell>> RenderedCell::Create(StandingPosts posts) {
  ASSIGN_OR_RETURN(CellConfig config, LoadCellConfig(kStation / "cell.toml", kScaleDivisor));
  const fs::path folder = fs::temp_directory_path() / fmt::format("forgescan_line_{}", ::getpid());
  RETURN_IF_ERROR(WriteFiles(config, folder, posts));
  return std::unique_ptr<RenderedCell>(new RenderedCell(std::make_unique<Cell>(std::move(config)), folder));
}

int RenderedCell::width_px() const { return cell_->cell.config().rig.left.width_px; }
int RenderedCell::height_px() const { return cell_->cell.config().rig.left.height_px; }
int RenderedCell::view_count() const { return static_cast<int>(cell_->cell.config().views.size()); }
std::uint32_t RenderedCell::path_crc32() const { return PathCrc32(cell_->cell.config().views); }

Result<const RenderedView*> RenderedCell::View(int part, int view) {
  if (const auto found = views_.find({part, view}); found != views_.end()) {
    return &found->second;
  }
  const VirtualCell& cell = cell_->cell;
  ASSIGN_OR_RETURN(PartState part_state, cell.Part(part));
  const bool is_there = !taken_away_.contains(part);
  if (!is_there) part_state.array_from_part.translation().x() += kOutOfSightMm;
  ASSIGN_OR_RETURN(const ViewState view_state, cell.View(part_state, view));
  RenderedView rendered{.pyrometer_degc = is_there ? view_state.pyrometer_degc : std::nan(""), .images = {}};
  for (const Side side : {Side::kLeft, Side::kRight}) {
    ASSIGN_OR_RETURN(const GeometryMap map, cell.Map(part_state, view_state, side));
    for (std::size_t i = 0; i < cell_->patterns.size(); ++i) {
      rendered.images[side == Side::kLeft ? 0 : 1].push_back(
          cell.Image(map, view_state, side, cell_->patterns[i], static_cast<int>(i)));
    }
  }
  return &views_.emplace(std::make_pair(part, view), std::move(rendered)).first->second;
}

Result<std::map<std::string, double>> RenderedCell::TrueSizesMm(int part) const {
  ASSIGN_OR_RETURN(const PartState state, cell_->cell.Part(part));
  std::map<std::string, double> sizes_mm;
  for (const AxleDimension& dimension : kAxleDimensions) {
    sizes_mm[dimension.name] = state.size.*dimension.size_mm;
  }
  return sizes_mm;
}

}  // namespace forgescan::testing
