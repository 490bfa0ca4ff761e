// The axle as OpenCASCADE shapes: only for axle.cc, so that nobody else compiles against OpenCASCADE.
#pragma once

#include <TopoDS_Shape.hxx>
#include <vector>

#include "tools/virtual_station/axle.h"

namespace forgescan {

// A closed body that overlaps its neighbours inside the material, and how finely its surface is to be meshed.
struct AxlePiece {
  TopoDS_Shape shape;
  double chord_mm;
};

// Both throw Standard_Failure. `size` is checked before.
std::vector<AxlePiece> AxleMeshPieces(const AxleSize& size);
// The union of the pieces, one solid. Cost: seconds.
TopoDS_Shape AxleSolid(const AxleSize& size);

}  // namespace forgescan
