// A station's folder: its configuration, calibration and memory.
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "services/camera/camera_config.h"
#include "services/common/calibration/placements_file.h"
#include "services/common/imaging/stereo_calibration.h"
#include "services/common/input_file.h"
#include "services/common/service/station.h"
#include "services/cooling/cooling_config.h"
#include "services/fusion/fusion_config.h"
#include "services/fusion/standing_file.h"
#include "services/fusion/view_matrices.h"
#include "services/reconstruction/pattern_set.h"
#include "services/reconstruction/reconstruction_service.h"
#include "services/recorder/recorder_config.h"
#include "services/recorder/recording_name.h"
#include "services/registration/registration_config.h"
#include "services/report/history.h"
#include "services/report/kept_parts.h"
#include "services/report/report_config.h"
#include "services/robot/part_memory.h"
#include "services/robot/robot_config.h"
#include "services/trigger/trigger_config.h"
#include "tests/fuzz/readers.h"
#include "tools/forgescan/station/station_lock.h"
#include "tools/forgescan/station/supervision_policy.h"
#include "tools/virtual_station/cell_config.h"

namespace forgescan::fuzz {
namespace {

constexpr char kStationFile[] = "station.toml";

// Every service's table; what a service refuses is refused.
Result<Station> LoadWithServices(const std::string& folder) {
  ASSIGN_OR_RETURN(const Station station, Station::Load(folder));
  const auto table = [&station](const char* name) { return station.file.Table(name); };
  for (const char* side : {"left", "right"}) {
    ASSIGN_OR_RETURN([[maybe_unused]] const auto camera, CameraConfig::Load(table("camera"), side));
  }
  ASSIGN_OR_RETURN([[maybe_unused]] const auto cooling, CoolingConfig::Load(table("cooling")));
  ASSIGN_OR_RETURN([[maybe_unused]] const auto fusion, FusionConfig::Load(table("fusion")));
  ASSIGN_OR_RETURN([[maybe_unused]] const auto views,
                   ReconstructionServiceConfig::Load(table("reconstruction")));
  ASSIGN_OR_RETURN([[maybe_unused]] const auto recorder, RecorderConfig::Load(table("recorder")));
  ASSIGN_OR_RETURN(const auto registration, RegistrationConfig::Load(table("registration")));
  if (!registration.model_from_array.matrix().allFinite()) return Fail(ErrorCode::kFormat, "not finite");
  ASSIGN_OR_RETURN([[maybe_unused]] const auto report, ReportConfig::Load(table("report")));
  ASSIGN_OR_RETURN([[maybe_unused]] const auto robot, RobotConfig::Load(table("robot")));
  ASSIGN_OR_RETURN(const auto trigger, TriggerConfig::Load(table("trigger")));
  ASSIGN_OR_RETURN([[maybe_unused]] const auto plan, PlanTrigger(trigger));
  ASSIGN_OR_RETURN([[maybe_unused]] const auto policy, SupervisionPolicy::Load(station.file));
  return station;
}

Outcome ReadStation(const std::string& bytes) {
  ScratchFile(kStationFile, bytes);
  // A service's Check() and PlanTrigger() name the key; the service that calls them names the file.
  return Judge(LoadWithServices(ScratchFolder().string()), "", [](const Station& station) {
    return station.name.empty() || station.model.empty() ? "a station without a name or a model" : "";
  });
}

Outcome ReadCell(const std::string& bytes) {
  return Judge(LoadCellConfig(ScratchFile("cell.toml", bytes)), "cell.toml",
               [](const CellConfig& cell) { return cell.views.empty() ? "a cell without views" : ""; });
}

std::string CalibrationText() {
  const auto matrix = [](const char* key, int rows, int columns, const char* data) {
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n", key,
                       rows, columns, data);
  };
  std::string text = "%YAML:1.0\n---\n";
  for (const char* side : {"l", "r", "p"}) {
    text += matrix(fmt::format("K{}", side).c_str(), 3, 3, "600., 0., 160., 0., 600., 120., 0., 0., 1.");
    text += matrix(fmt::format("D{}", side).c_str(), 1, 5, "0., 0., 1.e-3, 0., 0.");
  }
  for (const char* side : {"", "p"}) {
    text += matrix(fmt::format("R{}", side).c_str(), 3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.");
    text += matrix(fmt::format("T{}", side).c_str(), 3, 1, "-100., 0., 0.");
  }
  return text + "image_width: 320\nimage_height: 240\n";
}

Outcome ReadCalibration(const std::string& bytes) {
  return Judge(LoadStereoCalibration(ScratchFile("stereo.yaml", bytes)), "stereo.yaml",
               [](const StereoCalibration& calibration) { return ProblemOf(Check(calibration)); });
}

constexpr char kPattern[] = R"(projector_width_px = 1280
background = "shared"
reference = "white.png"
reference_contrast = 0.9
[[frequency]]
period_px = 20
frames = ["1.png", "2.png", "3.png"]
shifts_deg = [0, 90, 180]
[[frequency]]
period_px = 20.5
modulation_ratio = 0.98
frames = ["4.png", "5.png"]
shifts_deg = [0, 90]
)";
constexpr char kViews[] = R"(path_crc32 = 4023233417
recorded_body_degc = 31.5
[[view]]
index = 0
array_from_camera = [1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1]
[[view]]
index = 1
array_from_camera = [0.0, -1.0, 0, -5.5, 1, 0, 0, 600, 0, 0, 1, 7e2, 0, 0, 0, 1]
)";

Outcome ReadStanding(const std::string& bytes) {
  return Judge(LoadStandingSurfaces(ScratchFile("standing.ply", bytes), {1, 2}, 2), "standing.ply",
               [](const StandingSurfaces& standing) {
                 for (const auto& view : standing.views) {
                   for (const SurfaceCell& cell : view) {
                     if (!cell.point.allFinite() || !(cell.variance_mm2 > 0))
                       return "a cell that is no number";
                   }
                 }
                 return "";
               });
}

std::string StandingBytes() {
  StandingSurfaces standing{{1, 2}, 0.003, 1, std::vector<std::vector<SurfaceCell>>(2)};
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d point(3.0 * i + 1, 1, 650);
    standing.views[static_cast<std::size_t>(i % 2)].push_back(
        {DirectionKey(point, standing.cell_rad).value(), point, -Eigen::Vector3d::UnitZ(), 1e-4});
  }
  const std::string path = ScratchFile("written.ply", "");
  return WriteStandingSurfaces(path, standing).ok() ? ReadInputFile(path).value() : std::string();
}

constexpr char kPlacements[] = R"(distance_mm = 125.0123
expanded_uncertainty_mm = 0.001
ball_radius_mm = 19.05
volume_mm = [240, 240, 160]
calibration_crc32 = 4294967295
[prior]
focal_px = 0.3
[[placement]]
name = "low"
center_1_mm = [10, 20, 650]
center_2_mm = [135, 20, 650]
[[placement]]
name = "deep"
center_1_mm = [50, 20.5, 600]
center_2_mm = [50, 20, 7e2]
)";

// Whatever the file says, the refinement it is for ends with a sentence: two placements are too few.
Outcome ReadPlacements(const std::string& bytes) {
  return Judge(ParsePlacements(bytes, "bar.toml", ScratchFolder()), "bar.toml",
               [](const PlacementsFile& file) -> std::string {
                 const auto placements = MeasurePlacements(file);
                 if (!placements.ok()) return SentenceProblem(placements.error(), "");
                 const auto rig = LoadStereoCalibration(ScratchFile("good.yaml", CalibrationText()));
                 const auto refined = RefineCalibration(*rig, file.bar, *placements, file.options);
                 return refined.ok() ? "a refinement from two placements" : "";
               });
}

Outcome ReadPattern(const std::string& bytes) {
  return Judge(ParsePatternSet(bytes, "pattern.toml"), "pattern.toml",
               [](const PatternSet& pattern) { return ProblemOf(Check(pattern)); });
}

Outcome ReadViews(const std::string& bytes) {
  return Judge(ViewMatrices::Load(ScratchFile("views.toml", bytes)), "views.toml",
               [](const ViewMatrices& views) {
                 const auto is_rigid = [](const Eigen::Isometry3d& pose) {
                   const Eigen::Matrix3d rotation = pose.linear();
                   return pose.matrix().allFinite() && (rotation * rotation.transpose()).isIdentity(1e-5);
                 };
                 const auto& all = views.array_from_camera;
                 return std::all_of(all.begin(), all.end(), is_rigid) ? "" : "a view that is not rigid";
               });
}

// A memory that cannot be read is told and left; one that is read can be written again.
Outcome ReadPartMemory(const std::string& bytes) {
  PartMemory memory(ScratchFile("robot_parts", bytes));
  const Status recalled = memory.Recall();
  if (!recalled.ok()) return {false, SentenceProblem(recalled.error(), "robot_parts")};
  const auto last = memory.Last();
  if (last && last->first < 1) return {true, "a part with a number below 1"};
  return {true, ProblemOf(memory.Begin(1, {}))};
}

Outcome ReadKeptParts(const std::string& bytes) {
  KeptParts kept(ScratchFile("report_parts", bytes));
  const Status recalled = kept.Recall();
  if (!recalled.ok()) return {false, SentenceProblem(recalled.error(), "report_parts")};
  std::string problem = ProblemOf(kept.Begin(1, 1));
  kept.ForEach([&problem](int part, const KeptPart& one) {
    if (one.verdict && one.verdict->part != part) problem = "a verdict of another part";
  });
  return {true, problem};
}

std::string KeptPartsText() {
  KeptParts kept(ScratchFile("written_parts", ""));
  fsmsg::verdict_t verdict{};
  verdict.part = 2;
  verdict.dimension_count = 1;
  verdict.dimensions.resize(1);
  verdict.dimensions[0].name = "length";
  const bool written = kept.Begin(1, 1'700'000'000'000'000).ok() && kept.Begin(2, 5).ok() &&
                       kept.Arrived(2, 7).ok() && kept.Judged(verdict).ok();
  return written ? ReadInputFile((ScratchFolder() / "written_parts").string()).value() : std::string();
}

std::string HistoryBytes() {
  const std::string path = (ScratchFolder() / "written.sqlite").string();
  auto history = History::Open(path);
  JudgedDimension dimension;
  dimension.name = "length";
  for (int part = 1; history.ok() && part <= 3; ++part) {
    static_cast<void>(
        history->Append({part, 1000 + part, Verdict::kOk, "reason", "folder", {dimension}}).ok());
  }
  return ReadInputFile(path).value();
}

// Opening writes, and so does a part: into the damaged file as into a good one.
Outcome ReadHistory(const std::string& bytes) {
  const std::string path = ScratchFile("history.sqlite", bytes);
  for (const char* beside : {"-journal", "-wal"}) std::filesystem::remove(path + beside);
  const auto history = History::Open(path);
  if (!history.ok()) return {false, SentenceProblem(history.error(), "history.sqlite")};
  const auto parts = history->LastParts(10);
  if (!parts.ok()) return {false, SentenceProblem(parts.error(), "history.sqlite")};
  return Judge(history->LastValues("length", 10), "history.sqlite");
}

// The file of a supervisor that was killed: what is taken over from it are processes that may still run.
Outcome ReadStationPid(const std::string& bytes) {
  ScratchFile("station.pid", bytes);
  const auto lock = StationLock::Take(ScratchFolder().string(), 10);
  if (!lock.ok()) return {false, SentenceProblem(lock.error(), "station.pid")};
  return {true, ProblemOf(lock->Write(lock->left_behind()))};
}

// Lines of the text are the files of the recordings' folder.
Outcome ReadRecordingNames(const std::string& bytes) {
  std::vector<StoredRecording> files;
  for (std::size_t at = 0; at < bytes.size() && files.size() < 1000;) {
    const std::size_t end = std::min(bytes.find('\n', at), bytes.size());
    const auto size = static_cast<std::int64_t>(bytes.size());
    files.push_back(
        {"/r/parts/" + bytes.substr(at, end - at), size * 1'000'000, false, 1'800'000'000'000'000, 1});
    at = end + 1;
  }
  RetentionRules rules;
  rules.quota_bytes = 2'000'000;
  const RetentionPlan plan = PlanRetention(files, rules, {{1, 0}}, 1'900'000'000'000'000);
  for (const Deletion& deletion : plan.deletions) {
    const std::string name = deletion.path.substr(deletion.path.find_last_of('/') + 1);
    const auto recording = ParseRecordingName(name);
    if (!recording) return {true, "would delete what is no recording: " + name};
    if (NameOf(*recording) != name) return {true, "has another name for " + name};
  }
  return {true, {}};
}

constexpr char kRecordings[] =
    "20261122T141507.123456Z_part000042.lcmlog.part\n20261122T141508.123456Z_part000043_OK.lcmlog\n"
    "20260122T141507.123456Z_part000044_NOT_OK_INCOMPLETE.lcmlog\n20261122T141507.123456Z.lcmlog\nnotes."
    "txt\n";

}  // namespace

std::vector<Reader> Readers() {
  return {
      {"station", 1500, {RepositoryFile("stations/template/station.toml")}, ReadStation},
      {"cell", 1000, {RepositoryFile("stations/virtual/cell.toml")}, ReadCell},
      {"calibration", 3000, {CalibrationText()}, ReadCalibration},
      {"placements", 3000, {kPlacements}, ReadPlacements},
      {"pattern", 5000, {kPattern}, ReadPattern},
      {"views", 3000, {kViews}, ReadViews},
      {"standing", 5000, {StandingBytes()}, ReadStanding},
      {"part_memory", 3000, {"7 1700000000000000 10 3 0 0\n8 1700000000000001 10 10 1 1\n"}, ReadPartMemory},
      {"kept_parts", 3000, {KeptPartsText()}, ReadKeptParts},
      {"history", 500, {HistoryBytes()}, ReadHistory},
      {"station_pid", 3000, {"1 2 10\nrobot 0 1 3 0\ntrigger 4194400 1 3 1\n"}, ReadStationPid},
      {"recording_names", 5000, {kRecordings}, ReadRecordingNames}};
}

}  // namespace forgescan::fuzz
