// One inspection in one process: the virtual cell's images through the services' own computations, with the
// files and settings of a commissioned station. Nothing of the cell's truth reaches them: calibration,
// pattern, view matrices, model and settings are read from the files that commissioning wrote.
#pragma once

#include <array>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "services/common/imaging/stereo_calibration.h"
#include "services/fusion/fuse.h"
#include "services/fusion/fusion_config.h"
#include "services/fusion/visit_correction.h"
#include "services/reconstruction/reconstruction_service.h"
#include "services/registration/registration_config.h"
#include "services/report/model_evaluator.h"
#include "tools/forgescan/experiment/experiment.h"
#include "tools/forgescan/standing/empty_cell.h"
#include "tools/virtual_station/virtual_cell.h"

namespace forgescan {

// A station's folder as the services load it.
struct StationFiles {
  ReconstructionServiceConfig reconstruction;
  FusionConfig fusion;
  RegistrationConfig registration;
  DimensionOptions dimensions;
  PatternSet pattern;
  StereoCalibration calibration;
  ViewMatrices views;
  ModelBundle model;
  Features features;
};

// Commissions the cell into a scratch folder with the reduced set and the settings of the station's file, and
// loads what that wrote. Cost: 4 s, the CAD model. Errors: those of both.
Result<StationFiles> Commission(const CellConfig& config, const ExperimentOptions& options);

// Every image of a camera, in the order of projection, 8 bit.
std::vector<cv::Mat> ExposeAll(const GeometryMap& map, const CellConfig& config,
                               const std::vector<Pattern>& patterns, ImageKey key, int threads);

struct InspectedPart {
  std::vector<MeasuredDimension> dimensions;
  double registration_rms_mm = 0;
  std::size_t points = 0, part_points = 0;
};

class VirtualInspection {
 public:
  static Result<VirtualInspection> Create(CellConfig config, const ExperimentOptions& options);
  // Of a station that was commissioned, and possibly mended since (bar_refinement.h).
  static Result<VirtualInspection> Create(CellConfig config, StationFiles files, int threads);

  const VirtualCell& cell() const { return *cell_; }
  const CellConfig& config() const { return cell_->config(); }

  // Images of both cameras, reconstruction, thinning as the service publishes. The view's temperature is what
  // the pyrometer says.
  Result<ViewCloud> Scan(const PartState& part, const ViewState& view) const {
    return ScanView(*cell_, *reconstructor_, part, view);
  }
  // Fusion, registration, dimensions.
  Result<InspectedPart> Measure(const std::vector<ViewCloud>& views) const {
    return Measure(views, files_.views);
  }
  // With other view matrices.
  Result<InspectedPart> Measure(const std::vector<ViewCloud>& views, const ViewMatrices& matrices) const;

  const ViewMatrices& matrices() const { return files_.views; }

  // By the posts, as one scan of the cell without the part shows them in these views.
  Result<VisitCorrection> Correction(const PartState& part, const std::vector<ViewState>& views) const;

 private:
  VirtualInspection() = default;

  StationFiles files_;
  std::shared_ptr<const VirtualCell> cell_;
  std::shared_ptr<const Reconstructor> reconstructor_;
  std::shared_ptr<const RegistrationModel> model_;
  std::shared_ptr<const ModelEvaluator> evaluator_;
};

// The cell's file at the image size asked for, with the experiment's seed.
Result<CellConfig> LoadExperimentCell(const ExperimentOptions& options);

// Where the robot stands if its scatter acts about the point it looks at, as repeatability is measured (ISO
// 9283: at the tool point; the paper's: at the balls), and not about the scanner.
ViewState ScatterAtTarget(const ViewState& view, const CellConfig& config);

// The view matrices as they would be if this visit's error of the robot were known: what is left is the
// scanner's and the algorithms' own.
ViewMatrices WithoutRobot(const ViewMatrices& matrices, const std::vector<ViewState>& views,
                          const CellConfig& config);

}  // namespace forgescan
