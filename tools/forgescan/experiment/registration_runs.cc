#include "tools/forgescan/experiment/registration_runs.h"

#include <algorithm>

#include "tools/forgescan/experiment/draws.h"
#include "tools/forgescan/experiment/trimmed_icp.h"
#include "tools/virtual_station/parallel.h"

namespace forgescan {
namespace {

constexpr double kWrongMm = 1;

template <typename Align>
std::vector<double> RunAll(const Workpiece& workpiece, const ScanRequest& request,
                           const ExperimentOptions& options, const Align& align) {
  std::vector<double> corner_mm(static_cast<std::size_t>(options.runs));
  ForEachIndex(options.runs, options.threads, [&](int run) {
    ScanRequest one = request;
    one.seed = options.seed;
    one.run = run;
    corner_mm[static_cast<std::size_t>(run)] = align(DrawStart(workpiece, one));
  });
  return corner_mm;
}

}  // namespace

StartCase DrawStart(const Workpiece& workpiece, const ScanRequest& request) {
  RandomStream random = DrawsOf(request.seed, Draw::kStart, {request.run});
  const Eigen::Isometry3d scan_from_model =
      RandomOffset(workpiece.model.center(), kStartTurnRad, kStartShiftMm, random);
  return {scan_from_model, MovedCloud(SampleScan(workpiece, request), scan_from_model)};
}

std::vector<double> RunOurs(const Workpiece& workpiece, const ScanRequest& request,
                            const ExperimentOptions& options) {
  IcpOptions icp;
  icp.start_translation_mm = kStartShiftMm;
  icp.threads = 1;  // the runs are spread over threads instead
  return RunAll(workpiece, request, options, [&](const StartCase& start) {
    const auto result = RegisterScan(start.scan, workpiece.model, Eigen::Isometry3d::Identity(), icp);
    return result.ok() ? CornerMotionMm(result->model_from_scan * start.scan_from_model, workpiece.model)
                       : kRefused;
  });
}

std::vector<double> RunTrimmed(const Workpiece& workpiece, const ScanRequest& request, double overlap_share,
                               const ExperimentOptions& options) {
  TrimmedIcpOptions trimmed;
  trimmed.overlap_share = overlap_share;
  return RunAll(workpiece, request, options, [&](const StartCase& start) {
    const auto result =
        AlignTrimmed(start.scan.points, workpiece.model.surface(), Eigen::Isometry3d::Identity(), trimmed);
    return CornerMotionMm(result.model_from_scan * start.scan_from_model, workpiece.model);
  });
}

Tally Count(const std::vector<double>& corner_mm, double right_mm) {
  Tally tally;
  std::vector<double> accepted;
  for (const double corner : corner_mm) {
    ++tally.runs;
    if (corner == kRefused) {
      ++tally.refused;
      continue;
    }
    accepted.push_back(corner);
    ++(corner < right_mm ? tally.right : corner < kWrongMm ? tally.near : tally.wrong);
  }
  std::sort(accepted.begin(), accepted.end());
  if (!accepted.empty()) {
    tally.median_mm = accepted[accepted.size() / 2];
    tally.worst_mm = accepted.back();
  }
  return tally;
}

}  // namespace forgescan
