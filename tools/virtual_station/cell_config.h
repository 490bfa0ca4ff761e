// Everything adjustable about the virtual cell: the only home of its numbers is the file
// (stations/virtual/cell.toml). Every imperfection is a number here; zero switches it off.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/common/result.h"
#include "tools/virtual_station/axle.h"
#include "tools/virtual_station/camera.h"
#include "tools/virtual_station/thermal.h"

namespace forgescan {

// A part one size of which went wrong, whatever scatter and wear would have made of it.
struct OddPart {
  int part;
  double AxleSize::*size_mm;  // which
  double mm;
};

struct PartConfig {
  AxleSize nominal;
  double length_sd_mm, plate_sd_mm, cylinder_sd_mm;          // from part to part
  double plate_wear_mm_per_part, cylinder_wear_mm_per_part;  // die wear: the trend
  double position_scatter_mm;                                // uniform +- on each axis
  double rotation_scatter_deg;                               // uniform +- about each axis
  double length_tolerance_mm, plate_tolerance_mm,
      cylinder_tolerance_mm;  // +- about nominal, for features.toml
  std::vector<OddPart> odd_parts;
};

struct HeatConfig {
  double reference_degc;  // the temperature at which CAD sizes hold
  double start_degc, start_sd_k;
  double first_view_s, view_interval_s;  // after the start temperature was reached
  CoolingLaw law;
  double pyrometer_bias_sd_k, pyrometer_noise_sd_k;
};

struct RobotScatter {
  double position_sd_mm, rotation_sd_rad;  // per axis and visit
  double marker_sd_mm;                     // of a reconstructed marker, per axis, when a view is taught
  int markers;                             // per view
};

// Errors of the written calibration against the true rig, standard deviations.
struct CalibrationErrorConfig {
  double focal_sd_px, centre_sd_px;
  double k1_sd;
  double rotation_sd_rad, translation_sd_mm;
};

// Relative errors of what the station's files say of light, cameras and steel, standard deviations.
struct CommissioningErrorConfig {
  double contrast_sd;         // of each contrast of the pattern
  double noise_sd;            // of the cameras' read noise, and of their gain
  double expansion_sd;        // of the whole expansion curve: the sample is of another heat of the steel
  double expansion_point_sd;  // of each point of it, absolute
};

struct ProjectorLightConfig {
  double mean_level, amplitude;  // of the sinusoid, fractions of full projector drive; white is 1
  double second_harmonic_ratio;  // second over first harmonic left after linearisation
  double black_level;            // light of a dark pixel, fraction of white
  double blur_px;                // standard deviation of projector and lens blur, projector px
  double level_sd;               // change of total light from pattern to pattern, fraction
  double unambiguous_px;  // the beat of the frequencies: wider than the projector, so that its edges are not
                          // alike
  std::vector<int> fringe_counts;  // over unambiguous_px; three, the three-step one first
};

struct SensorConfig {
  double read_noise_dn;
  double gain_dn;  // variance per DN of signal: sigma^2 = read^2 + gain * I
  double dark_level_dn;
  double white_dn;  // of a white-lit surface of albedo 1 facing projector and camera at the working distance
  double ambient_dn;  // of a surface of albedo 1
  double glow_dn;     // of the part at 900 degC, after the filters
  double glow_per_k;  // relative slope (Wien)
};

struct SurfaceConfig {
  double part_albedo, cell_albedo;
  double texture_contrast;  // of the scale on the part, +- fraction
  double texture_size_mm;
  double specular;  // strength of the gloss lobe at its peak, fraction of white
};

struct ViewConfig {
  Eigen::Vector3d target_mm;  // array frame: what the rig looks at
  Eigen::Vector3d towards_rig;
  Eigen::Vector3d baseline;  // from left to right camera; made normal to the viewing direction
  double exposure;           // factor on all light of this view
};

// A box of the conveyor or clamp. Array frame.
struct BoxConfig {
  Eigen::Vector3d low_mm, high_mm;
};

// A square post that stands still beside the part, with three faces to each view that sees it. Array frame.
struct PostConfig {
  Eigen::Vector3d top_mm;  // middle of its top
  double width_mm;
  double foot_z_mm;
  double turn_deg;  // about z; 0: its sides face along x and y
};

struct CellConfig {
  std::uint64_t seed = 0;
  double working_distance_mm = 0.0;
  Rig rig;  // true; scaled to the image size asked for
  PartConfig part;
  HeatConfig heat;
  RobotScatter robot;
  CalibrationErrorConfig calibration_error;
  CommissioningErrorConfig commissioning_error;
  ProjectorLightConfig projector_light;
  SensorConfig sensor;
  SurfaceConfig surface;
  std::vector<ViewConfig> views;
  std::vector<BoxConfig> boxes;
  std::vector<PostConfig> posts;
};

// `scale_divisor` overrides image.scale_divisor of the file when it is not 0: tests render 1/4-size images of
// the same cell. A side becomes a multiple of 4 px, as virtual cameras have it. Errors: kNotFound, kFormat
// naming file, section, key and limits.
Result<CellConfig> LoadCellConfig(const std::string& path, int scale_divisor = 0);

}  // namespace forgescan
