// The forging the virtual station inspects: a front-axle-like beam with two spring-seat plates and two end
// cylinders.
//
// Frame "part" (also the frame of the design model): x along the axle (left = -x), z up, y across, origin in
// the middle of the axis of the end cylinders. Units: mm, at the reference temperature.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "services/common/result.h"
#include "tools/virtual_station/surface_mesh.h"

namespace forgescan {

// The five inspected dimensions; everything else about the axle is fixed. The defaults are the design
// (nominal) values.
struct AxleSize {
  double total_length_mm = 1888.4;  // between the planar end faces
  double left_plate_width_mm = 178.9;
  double right_plate_width_mm = 177.4;
  double left_cylinder_diameter_mm = 89.7;
  double right_cylinder_diameter_mm = 88.5;
};

// By the names that features.toml and reports use.
struct AxleDimension {
  const char* name;
  double AxleSize::*size_mm;
};
inline constexpr std::array<AxleDimension, 5> kAxleDimensions = {
    {{"total_length", &AxleSize::total_length_mm},
     {"left_plate_width", &AxleSize::left_plate_width_mm},
     {"right_plate_width", &AxleSize::right_plate_width_mm},
     {"left_cylinder_diameter", &AxleSize::left_cylinder_diameter_mm},
     {"right_cylinder_diameter", &AxleSize::right_cylinder_diameter_mm}}};

// Within 5 % of the design: beyond, the pieces of the shape would no longer meet as intended. Errors:
// kInvalidArgument.
Status Check(const AxleSize& size);

// The names of the eight CAD faces that carry dimensions: left_end_face, left_cylinder, left_plate_front
// (+y), left_plate_back (-y), and the same on the right.
std::vector<std::string> AxleFaceNames();

// The surface for rendering: chord error <= 0.001 mm on the end cylinders (their radius is 0.0007 mm small on
// average), 0.1 mm on the beam, which carries no dimension; planes are exact. The pieces (beam, plates,
// ends) are closed surfaces that overlap inside the material. Frame: part. Cost: about 0.3 s.
Result<SurfaceMesh> BuildAxleMesh(const AxleSize& size);

// Writes the solid as STEP (AP214, mm) with the names of AxleFaceNames() on its faces. The file appears
// complete or not.
Status WriteAxleStep(const AxleSize& size, const std::string& path);

// Writes the surface of the solid as binary STL, chord error 0.05 mm. Cost: about 1 s, as WriteAxleStep.
Status WriteAxleStl(const AxleSize& size, const std::string& path);

}  // namespace forgescan
