// Section 2.1.3: repeatability of robot and scanner on a pair of ceramic balls.
#include <algorithm>
#include <cmath>

#include "services/common/features/enclosing_ball.h"
#include "tools/forgescan/experiment/ball_fit.h"
#include "tools/forgescan/experiment/ball_scene.h"
#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/experiment/virtual_inspection.h"
#include "tools/virtual_station/scene.h"

namespace forgescan {
namespace {

constexpr int kSeries = 2000;
constexpr double kDistanceGoalMm = 0.010;

using BallPair = std::array<Eigen::Vector3d, 2>;

struct Visit {
  BallPair measured;      // centres in the array frame by the taught view matrix
  BallPair robot;         // where a perfect scanner on this robot would have seen them
  BallPair robot_at_rig;  // the same, had the robot scattered about the scanner
  double radius_mm[2];
};

// Where a point of the scene lies in the array frame for one who takes the robot to be where it was taught.
Eigen::Vector3d SeenFrom(const ViewState& view, const CellConfig& config, const Eigen::Vector3d& p_in_array) {
  return TaughtRigPose(config.views.front(), config.working_distance_mm) *
         (view.array_from_rig.inverse() * p_in_array);
}

struct Bench {
  StationFiles files;
  VirtualCell cell;
  Reconstructor reconstructor;
  PartState part;
};

Result<Visit> Measure(const Bench& bench, int number, int threads) {
  ASSIGN_OR_RETURN(ViewState at_rig, bench.cell.View(bench.part, 0, 0, number));
  at_rig.part_degc = 20;
  at_rig.scale = 1;
  const ViewState view = ScatterAtTarget(at_rig, bench.cell.config());
  std::array<std::vector<cv::Mat>, 2> images;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    ASSIGN_OR_RETURN(const GeometryMap map, bench.cell.Map(bench.part, view, side));
    images[static_cast<std::size_t>(side)] =
        ExposeAll(map, bench.cell.config(), bench.cell.Patterns(ProjectedSet::kReduced),
                  {bench.cell.config().seed, 0, 0, number, side, 0}, threads);
  }
  ASSIGN_OR_RETURN(const Reconstruction result, bench.reconstructor.Run(images[0], images[1]));
  const Eigen::Isometry3d& array_from_camera = bench.files.views.array_from_camera.front();
  PointCloud cloud_in_array;
  for (const Eigen::Vector3f& p : result.cloud_in_camera.points) {
    cloud_in_array.points.push_back((array_from_camera * p.cast<double>()).cast<float>());
  }
  Visit visit;
  const BallPair placed = BallCenters();
  for (std::size_t i = 0; i < 2; ++i) {
    ASSIGN_OR_RETURN(const FittedBall fit,
                     FitBall(cloud_in_array, placed[i], array_from_camera.translation()));
    visit.measured[i] = fit.center;
    visit.radius_mm[i] = fit.radius_mm;
    visit.robot[i] = SeenFrom(view, bench.cell.config(), placed[i]);
    visit.robot_at_rig[i] = SeenFrom(at_rig, bench.cell.config(), placed[i]);
  }
  return visit;
}

struct Envelope {
  double first_mm = 0, second_mm = 0;  // radius of the minimum enclosing ball of each ball's centres
  double cone_rad = 0;                 // full apex angle of the narrowest cone about the centre lines
  double iso_mm = 0;                   // ISO 9283: mean distance from the barycentre + 3 standard deviations
};

double IsoRepeatability(const std::vector<Eigen::Vector3d>& centers) {
  const auto count = static_cast<double>(centers.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& c : centers) mean += c / count;
  double sum = 0, squares = 0;
  for (const Eigen::Vector3d& c : centers) sum += (c - mean).norm();
  for (const Eigen::Vector3d& c : centers) squares += std::pow((c - mean).norm() - sum / count, 2);
  return sum / count + 3 * std::sqrt(squares / (count - 1));
}

Result<Envelope> EnvelopeOf(const std::vector<BallPair>& visits) {
  std::vector<Eigen::Vector3d> first, second, lines;
  for (const BallPair& pair : visits) {
    first.push_back(pair[0]);
    second.push_back(pair[1]);
    lines.push_back((pair[1] - pair[0]).normalized());
  }
  Envelope envelope;
  ASSIGN_OR_RETURN(const EnclosingBall a, MinimumEnclosingBall(first));
  ASSIGN_OR_RETURN(const EnclosingBall b, MinimumEnclosingBall(second));
  ASSIGN_OR_RETURN(const DirectionCone cone, MinimumCone(lines));
  envelope.first_mm = a.radius;
  envelope.second_mm = b.radius;
  envelope.cone_rad = cone.FullAngleRad();
  envelope.iso_mm = std::max(IsoRepeatability(first), IsoRepeatability(second));
  return envelope;
}

std::vector<std::string> Row(const char* what, const Envelope& envelope) {
  return {what, fmt::format("{:.4f}", envelope.first_mm), fmt::format("{:.4f}", envelope.second_mm),
          fmt::format("{:.4f}", envelope.iso_mm), fmt::format("{:.2e}", envelope.cone_rad)};
}

std::vector<BallPair> Of(const std::vector<Visit>& visits, BallPair Visit::*which) {
  std::vector<BallPair> pairs;
  for (const Visit& visit : visits) pairs.push_back(visit.*which);
  return pairs;
}

// What is left of the measured centres without the robot.
std::vector<BallPair> ScannerAlone(const std::vector<Visit>& visits) {
  const BallPair placed = BallCenters();
  std::vector<BallPair> pairs;
  for (const Visit& visit : visits) {
    pairs.push_back(
        {placed[0] + visit.measured[0] - visit.robot[0], placed[1] + visit.measured[1] - visit.robot[1]});
  }
  return pairs;
}

// Envelopes of the first ball over many series of visits of a robot with this scatter, ascending.
Result<std::vector<double>> RobotSeries(const CellConfig& config, const ExperimentOptions& options) {
  RandomStream random = DrawsOf(options.seed, Draw::kRobotSeries);
  std::vector<double> radius_mm;
  for (int series = 0; series < kSeries; ++series) {
    std::vector<Eigen::Vector3d> centers;
    for (int visit = 0; visit < options.runs; ++visit) {
      centers.push_back(SmallMotion(random, config.robot.position_sd_mm, config.robot.rotation_sd_rad) *
                        BallCenters()[0]);
    }
    ASSIGN_OR_RETURN(const EnclosingBall ball, MinimumEnclosingBall(centers));
    radius_mm.push_back(ball.radius);
  }
  std::sort(radius_mm.begin(), radius_mm.end());
  return radius_mm;
}

double DistanceOf(const Visit& visit) { return (visit.measured[1] - visit.measured[0]).norm(); }

// What the calibration alone makes of the distance, here and over many stations of the same care.
std::string CalibrationRemark(CellConfig config, const std::vector<Visit>& visits) {
  constexpr int kStations = 500;
  const double own_mm = DistanceByCalibration(config) - kBallDistanceMm;
  double rest_mm = 0;
  for (const Visit& visit : visits) {
    rest_mm = std::max(rest_mm, std::abs(DistanceOf(visit) - kBallDistanceMm - own_mm));
  }
  int within = 0;
  for (int station = 0; station < kStations; ++station) {
    config.seed = static_cast<std::uint64_t>(station + 1);
    within += std::abs(DistanceByCalibration(config) - kBallDistanceMm) <= kDistanceGoalMm ? 1 : 0;
  }
  return fmt::format(
      "Of the distance's error {:+.4f} mm are the written calibration's (truth: its rays, without noise), "
      "the same at every scan; the rest is {:.4f} mm at most. Of {} calibrations of the cell's care {:.0f} % "
      "are within {} mm.",
      own_mm, rest_mm, kStations, 100.0 * within / kStations, kDistanceGoalMm);
}

Table VisitTable(const std::vector<Visit>& visits, double& worst_mm) {
  Table table{{"scan", "distance mm", "error mm", "free radius 1 mm", "free radius 2 mm"}, {}};
  for (std::size_t i = 0; i < visits.size(); ++i) {
    const Visit& visit = visits[i];
    const double distance_mm = DistanceOf(visit);
    worst_mm = std::max(worst_mm, std::abs(distance_mm - kBallDistanceMm));
    table.rows.push_back({fmt::format("{}", i + 1), fmt::format("{:.4f}", distance_mm),
                          fmt::format("{:+.4f}", distance_mm - kBallDistanceMm),
                          fmt::format("{:.4f}", visit.radius_mm[0]),
                          fmt::format("{:.4f}", visit.radius_mm[1])});
  }
  return table;
}

// Centres about the mean of the measured ones, seen along z of the array.
Chart CenterChart(const std::vector<Visit>& visits, std::size_t ball) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d robot_mean = Eigen::Vector3d::Zero();
  for (const Visit& visit : visits) {
    mean += visit.measured[ball] / static_cast<double>(visits.size());
    robot_mean += visit.robot[ball] / static_cast<double>(visits.size());
  }
  Series measured{"measured", Mark::kDots, {}, {}, 0}, robot{"robot alone", Mark::kDots, {}, {}, 3};
  Series circle{"envelope goal, 11 um", Mark::kDashed, {}, {}, 5};
  for (const Visit& visit : visits) {
    measured.x.push_back(1000 * (visit.measured[ball] - mean).x());
    measured.y.push_back(1000 * (visit.measured[ball] - mean).y());
    robot.x.push_back(1000 * (visit.robot[ball] - robot_mean).x());
    robot.y.push_back(1000 * (visit.robot[ball] - robot_mean).y());
  }
  for (int i = 0; i <= 72; ++i) {
    circle.x.push_back(11 * std::cos(i * std::numbers::pi / 36));
    circle.y.push_back(11 * std::sin(i * std::numbers::pi / 36));
  }
  return {fmt::format("Centres of ball {}", ball + 1),
          {"x from the mean, um", false, -18.0, 18.0},
          {"y, um", false, -18.0, 18.0},
          {measured, robot, circle},
          {}};
}

Result<std::vector<Visit>> Scan(const CellConfig& config, const ExperimentOptions& options) {
  ASSIGN_OR_RETURN(StationFiles files, Commission(config, options));
  ASSIGN_OR_RETURN(Reconstructor reconstructor,
                   Reconstructor::Create(files.pattern, files.calibration,
                                         {config.rig.left.width_px, config.rig.left.height_px},
                                         files.reconstruction.reconstruction));
  const Bench bench{std::move(files), VirtualCell(config, options.threads), std::move(reconstructor),
                    BallPart()};
  std::vector<Visit> visits;
  for (int number = 0; number < options.runs; ++number) {
    ASSIGN_OR_RETURN(const Visit visit, Measure(bench, number, options.threads));
    visits.push_back(visit);
  }
  return visits;
}

struct Shares {
  Envelope measured, scanner;
  Table table;
};

Result<Shares> SharesOf(const std::vector<Visit>& visits) {
  Table table{{"", "envelope ball 1 mm", "envelope ball 2 mm", "ISO 9283 RP mm", "cone rad"}, {}};
  ASSIGN_OR_RETURN(const Envelope measured, EnvelopeOf(Of(visits, &Visit::measured)));
  ASSIGN_OR_RETURN(const Envelope robot, EnvelopeOf(Of(visits, &Visit::robot)));
  ASSIGN_OR_RETURN(const Envelope scanner, EnvelopeOf(ScannerAlone(visits)));
  ASSIGN_OR_RETURN(const Envelope at_rig, EnvelopeOf(Of(visits, &Visit::robot_at_rig)));
  table.rows = {Row("measured", measured), Row("robot's own share (truth)", robot),
                Row("scanner's own share", scanner),
                Row("robot's share, had it scattered about the scanner", at_rig)};
  return Shares{measured, scanner, table};
}

}  // namespace

Result<ExperimentReport> RunBalls(const ExperimentOptions& options) {
  if (options.runs < 3) {
    return Fail(ErrorCode::kInvalidArgument, "--runs is {}, an envelope needs at least 3 scans",
                options.runs);
  }
  ASSIGN_OR_RETURN(const CellConfig cell, LoadExperimentCell(options));
  const CellConfig config = BallCell(cell);
  ASSIGN_OR_RETURN(const std::vector<Visit> visits, Scan(config, options));
  ExperimentReport report;
  report.question = fmt::format(
      "{} scans of two balls {} mm apart, the robot coming anew each time with a scatter of {} mm and {:.1e} "
      "rad (standard deviation per axis) about the point it looks at. Envelope: minimum enclosing ball of a "
      "ball's centres, narrowest cone about the lines of centres (full apex angle). Truth: where each "
      "visit's error of the robot puts the centres.",
      options.runs, kBallDistanceMm, config.robot.position_sd_mm, config.robot.rotation_sd_rad);
  ASSIGN_OR_RETURN(const Shares shares, SharesOf(visits));
  report.tables.push_back(shares.table);
  double worst_mm = 0;
  report.tables.push_back(VisitTable(visits, worst_mm));
  report.goals = {
      {"envelope of the centres", std::max(shares.measured.first_mm, shares.measured.second_mm), 0.011, "mm"},
      {"full cone of the centre lines", shares.measured.cone_rad, 1.55e-4, "rad"},
      {"distance of the balls, worst error", worst_mm, kDistanceGoalMm, "mm"},
      {"scanner's own share of the envelope", std::max(shares.scanner.first_mm, shares.scanner.second_mm),
       0.003, "mm"}};
  ASSIGN_OR_RETURN(const std::vector<double> series, RobotSeries(config, options));
  report.remarks.push_back(fmt::format(
      "A perfect scanner on this robot finds an envelope of {:.4f} mm in the median of {} series of {} "
      "scans, and {:.4f} to {:.4f} mm in 90 % of them: whether the goal is met is mostly the luck of the ten "
      "visits.",
      series[series.size() / 2], kSeries, options.runs, series[series.size() / 20],
      series[series.size() - series.size() / 20]));
  report.remarks.push_back(CalibrationRemark(config, visits));
  report.svg = SvgFile("balls", 900, 470,
                       DrawChart(CenterChart(visits, 0), {0, 0, 450, 470}) +
                           DrawChart(CenterChart(visits, 1), {450, 0, 450, 470}));
  return report;
}

}  // namespace forgescan
