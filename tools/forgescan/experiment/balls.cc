// Section 2.1.3: repeatability of robot and scanner on a pair of ceramic balls.
#include <algorithm>
#include <cmath>

#include "services/common/features/enclosing_ball.h"
#include "tools/forgescan/experiment/ball_station.h"
#include "tools/forgescan/experiment/bar_stations.h"
#include "tools/forgescan/experiment/chart.h"
#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/experiment/envelope.h"
#include "tools/virtual_station/scene.h"

namespace forgescan {
namespace {

constexpr int kSeries = 2000;
constexpr int kStationsARun = 20;
constexpr double kDistanceGoalMm = 0.010;

std::vector<std::string> Row(const char* what, const Envelope& envelope) {
  return {what, fmt::format("{:.4f}", envelope.first_mm), fmt::format("{:.4f}", envelope.second_mm),
          fmt::format("{:.4f}", envelope.iso_mm), fmt::format("{:.2e}", envelope.cone_rad)};
}

std::vector<BallPair> Of(const std::vector<BallVisit>& visits, BallPair BallVisit::*which) {
  std::vector<BallPair> pairs;
  for (const BallVisit& visit : visits) pairs.push_back(visit.*which);
  return pairs;
}

// What is left of the measured centres without the robot.
std::vector<BallPair> ScannerAlone(const std::vector<BallVisit>& visits, const BallPair& placed) {
  std::vector<BallPair> pairs;
  for (const BallVisit& visit : visits) {
    pairs.push_back(
        {placed[0] + visit.taught[0] - visit.robot[0], placed[1] + visit.taught[1] - visit.robot[1]});
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
                        PairCenters(config)[0]);
    }
    ASSIGN_OR_RETURN(const EnclosingBall ball, MinimumEnclosingBall(centers));
    radius_mm.push_back(ball.radius);
  }
  std::sort(radius_mm.begin(), radius_mm.end());
  return radius_mm;
}

double DistanceOf(const std::array<FittedBall, 2>& balls) {
  return (balls[1].center - balls[0].center).norm();
}

double WorstError(const std::vector<BallVisit>& visits, std::array<FittedBall, 2> BallVisit::*which) {
  double worst_mm = 0;
  for (const BallVisit& visit : visits) {
    worst_mm = std::max(worst_mm, std::abs(DistanceOf(visit.*which) - kBallDistanceMm));
  }
  return worst_mm;
}

// What the calibrations alone make of the distance, here and over many stations of the same care.
std::string CalibrationRemark(const BallStation& station, int stations) {
  const auto own_mm = [&](const StereoCalibration& calibration) {
    const BallPair seen = SeenBy(calibration, station.config(), PairCenters(station.config()));
    return (seen[1] - seen[0]).norm() - kBallDistanceMm;
  };
  const BarStations care = RefineStations(station.config(), stations, kDistanceGoalMm);
  return fmt::format(
      "The calibration alone makes {:+.4f} mm of the distance's error before refinement and {:+.4f} mm after "
      "(truth: its rays, without noise), the same at every scan. Of {} calibrations of the cell's care "
      "{:.0f} % are within {} mm before and {:.0f} % after, {:.0f} % are refused. They err in the parameters "
      "that are refined only: errors of p1, p2 and of the other distortion are not drawn.",
      own_mm(station.commissioned()), own_mm(station.bar().refinement.calibration), stations,
      100.0 * care.within_before, kDistanceGoalMm, 100.0 * care.within_after, 100.0 * care.refused);
}

std::string Signed(double mm) { return fmt::format("{:+.4f}", mm); }

Table VisitTable(const std::vector<BallVisit>& visits) {
  Table table{{"scan", "error before refinement mm", "distance mm", "error mm", "free radius 1 mm",
               "free radius 2 mm"},
              {}};
  for (std::size_t i = 0; i < visits.size(); ++i) {
    const BallVisit& visit = visits[i];
    const double distance_mm = DistanceOf(visit.after);
    table.rows.push_back({fmt::format("{}", i + 1), Signed(DistanceOf(visit.before) - kBallDistanceMm),
                          fmt::format("{:.4f}", distance_mm), Signed(distance_mm - kBallDistanceMm),
                          fmt::format("{:.4f}", visit.after[0].radius_mm),
                          fmt::format("{:.4f}", visit.after[1].radius_mm)});
  }
  return table;
}

Table BarTable(const CalibrationRefinement& refinement) {
  Table table{{"placement of the bar", "error before mm", "after mm", "refined without it mm",
               "its standard deviation mm"},
              {}};
  for (const PlacementErrors& placement : refinement.placements) {
    table.rows.push_back({placement.name, Signed(placement.before_mm), Signed(placement.after_mm),
                          Signed(placement.left_out_mm), fmt::format("{:.4f}", placement.left_out_sigma_mm)});
  }
  return table;
}

// Centres about the mean of those with standing surfaces, seen along z of the array.
Chart CenterChart(const std::vector<BallVisit>& visits, std::size_t ball) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d robot_mean = Eigen::Vector3d::Zero();
  for (const BallVisit& visit : visits) {
    mean += visit.by_standing[ball] / static_cast<double>(visits.size());
    robot_mean += visit.robot[ball] / static_cast<double>(visits.size());
  }
  Series measured{"with standing surfaces", Mark::kDots, {}, {}, 0},
      robot{"robot alone", Mark::kDots, {}, {}, 3};
  Series circle{"envelope goal, 11 um", Mark::kDashed, {}, {}, 5};
  for (const BallVisit& visit : visits) {
    measured.x.push_back(1000 * (visit.by_standing[ball] - mean).x());
    measured.y.push_back(1000 * (visit.by_standing[ball] - mean).y());
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

struct Shares {
  Envelope by_standing, scanner;
  Table table;
};

Result<Shares> SharesOf(const std::vector<BallVisit>& visits, const BallPair& placed) {
  Table table{{"", "envelope ball 1 mm", "envelope ball 2 mm", "ISO 9283 RP mm", "cone rad"}, {}};
  ASSIGN_OR_RETURN(const Envelope taught, EnvelopeOf(Of(visits, &BallVisit::taught)));
  ASSIGN_OR_RETURN(const Envelope by_standing, EnvelopeOf(Of(visits, &BallVisit::by_standing)));
  ASSIGN_OR_RETURN(const Envelope robot, EnvelopeOf(Of(visits, &BallVisit::robot)));
  ASSIGN_OR_RETURN(const Envelope scanner, EnvelopeOf(ScannerAlone(visits, placed)));
  ASSIGN_OR_RETURN(const Envelope at_rig, EnvelopeOf(Of(visits, &BallVisit::robot_at_rig)));
  table.rows = {Row("measured, robot alone as taught", taught),
                Row("measured with standing surfaces", by_standing), Row("robot's own share (truth)", robot),
                Row("scanner's own share", scanner),
                Row("robot's share, had it scattered about the scanner", at_rig)};
  return Shares{by_standing, scanner, table};
}

std::string Question(const BallStation& station, int runs) {
  const RobotScatter& robot = station.config().robot;
  return fmt::format(
      "{} scans of two balls {} mm apart, the robot coming anew each time with a scatter of {} mm and {:.1e} "
      "rad (standard deviation per axis) about the point it looks at. Before, another bar, certified {:.4f} "
      "mm "
      "with U = {} mm (truth: {:.4f}), was scanned by hand at {} places, the calibration refined with it "
      "(forgescan calibration refine) and the view taught anew. Six cold blocks of 30 mm stand about the "
      "pair; "
      "one scan without the pair, at another visit, is what each scan's robot error is estimated against, as "
      "the fusion's standing surfaces do it. Envelope: minimum enclosing ball of a ball's centres, narrowest "
      "cone about the lines of centres (full apex angle). Truth: where each visit's error of the robot puts "
      "the centres.",
      runs, kBallDistanceMm, robot.position_sd_mm, robot.rotation_sd_rad,
      station.bar().certified.bar.distance_mm, 2 * station.bar().certified.bar.distance_sigma_mm,
      station.bar().certified.true_distance_mm, station.bar().refinement.placements.size());
}

std::string RefinementRemark(const CalibrationRefinement& refinement) {
  const auto& placements = refinement.placements;
  return fmt::format(
      "Sphere-spacing error of the bar (largest of its placements): {:.4f} mm before, {:.4f} mm after, "
      "{:.4f} "
      "mm for placements that were left out. Of {} directions in the calibration's parameters the lengths "
      "determine {}; columns of the projector then differ by {:.3f} px rms from the cameras' points, {:.3f} "
      "after it has followed.",
      LargestError(placements, &PlacementErrors::before_mm),
      LargestError(placements, &PlacementErrors::after_mm),
      LargestError(placements, &PlacementErrors::left_out_mm), kRigParameters,
      refinement.determined_directions, refinement.projector ? refinement.projector->rms_before_px : 0,
      refinement.projector ? refinement.projector->rms_px : 0);
}

}  // namespace

Result<ExperimentReport> RunBalls(const ExperimentOptions& options) {
  if (options.runs < 3) {
    return Fail(ErrorCode::kInvalidArgument, "--runs is {}, an envelope needs at least 3 scans",
                options.runs);
  }
  ASSIGN_OR_RETURN(const CellConfig cell, LoadExperimentCell(options));
  ASSIGN_OR_RETURN(const BallStation station, BallStation::Create(cell, options));
  std::vector<BallVisit> visits;
  for (int number = 0; number < options.runs; ++number) {
    ASSIGN_OR_RETURN(const BallVisit visit, station.Scan(number));
    visits.push_back(visit);
  }
  ExperimentReport report;
  report.question = Question(station, options.runs);
  ASSIGN_OR_RETURN(const Shares shares, SharesOf(visits, PairCenters(station.config())));
  report.tables = {shares.table, VisitTable(visits), BarTable(station.bar().refinement)};
  report.goals = {
      {"envelope of the centres, with standing surfaces",
       std::max(shares.by_standing.first_mm, shares.by_standing.second_mm), 0.011, "mm"},
      {"full cone of the centre lines, with standing surfaces", shares.by_standing.cone_rad, 1.55e-4, "rad"},
      {"distance of the balls, worst error", WorstError(visits, &BallVisit::after), kDistanceGoalMm, "mm"},
      {"scanner's own share of the envelope", std::max(shares.scanner.first_mm, shares.scanner.second_mm),
       0.003, "mm"}};
  ASSIGN_OR_RETURN(const std::vector<double> series, RobotSeries(station.config(), options));
  report.remarks.push_back(fmt::format(
      "A perfect scanner on this robot, as taught, finds an envelope of {:.4f} mm in the median of {} series "
      "of {} scans, and {:.4f} to {:.4f} mm in 90 % of them.",
      series[series.size() / 2], kSeries, options.runs, series[series.size() / 20],
      series[series.size() - series.size() / 20]));
  report.remarks.push_back(fmt::format("Before refinement the worst error of the distance is {:.4f} mm.",
                                       WorstError(visits, &BallVisit::before)));
  report.remarks.push_back(RefinementRemark(station.bar().refinement));
  report.remarks.push_back(CalibrationRemark(station, kStationsARun * options.runs));
  report.svg = SvgFile("balls", 900, 470,
                       DrawChart(CenterChart(visits, 0), {0, 0, 450, 470}) +
                           DrawChart(CenterChart(visits, 1), {450, 0, 450, 470}));
  return report;
}

}  // namespace forgescan
