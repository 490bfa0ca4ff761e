#include "tools/virtual_station/axle_shape.h"

#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepOffsetAPI_ThruSections.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <cmath>
#include <gp_Ax1.hxx>
#include <span>

namespace forgescan {
namespace {

constexpr double kCylinderLength = 130.0;
constexpr double kShoulderExcess = 12.0;  // radius of the shoulder over that of the cylinder
constexpr double kEndChamfer = 3.0;
constexpr double kPlateCentre = 500.0;
constexpr double kPlateLength = 150.0;
constexpr double kPlateBottom = -36.0;
constexpr double kPlateThickness = 35.0;
constexpr double kPlateFillet = 4.0;
constexpr double kCylinderChord = 0.002;
constexpr double kBeamChord = 0.1;

// One cross section of the beam: a rounded rectangle normal to x.
struct Section {
  double x, centre_z, width_y, height_z, corner_radius;
};

// The drop beam: straight between -x and +x of this section, then a gooseneck on each side (the right one is
// listed).
constexpr Section kStraight = {590, -60, 74, 78, 16};
constexpr Section kGooseneck[] = {
    kStraight, {640, -52, 77, 80, 17}, {690, -31, 82, 84, 19}, {735, -10, 86, 88, 22}, {785, 0, 90, 90, 26}};

TopoDS_Wire SectionWire(const Section& s) {
  const double w = 0.5 * s.width_y;
  const double h = 0.5 * s.height_z;
  const double r = s.corner_radius;
  const double k =
      r * (1.0 - std::sqrt(0.5));  // from the corner of the box to the middle of its arc, per axis
  const auto at = [&](double y, double z) { return gp_Pnt(s.x, y, s.centre_z + z); };
  BRepBuilderAPI_MakeWire wire;
  const double sign_y[] = {1, -1, -1, 1};
  const double sign_z[] = {1, 1, -1, -1};
  for (int i = 0; i < 4; ++i) {
    const int j = (i + 1) % 4;
    const double y = sign_y[i];
    const double z = sign_z[i];
    // Counter-clockwise: corner i runs from its vertical to its horizontal side when y*z > 0, the other way
    // otherwise.
    const gp_Pnt on_vertical = at(y * w, z * (h - r));
    const gp_Pnt on_horizontal = at(y * (w - r), z * h);
    const bool from_vertical = y * z > 0;
    const gp_Pnt middle = at(y * (w - k), z * (h - k));
    const gp_Pnt first = from_vertical ? on_vertical : on_horizontal;
    const gp_Pnt last = from_vertical ? on_horizontal : on_vertical;
    wire.Add(BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(first, middle, last).Value()).Edge());
    const gp_Pnt next =
        from_vertical ? at(sign_y[j] * (w - r), sign_z[j] * h) : at(sign_y[j] * w, sign_z[j] * (h - r));
    wire.Add(BRepBuilderAPI_MakeEdge(last, next).Edge());
  }
  return wire.Wire();
}

// The beam between two of the half's sections: a loft, or its mirror image for side = -1.
TopoDS_Shape Loft(std::span<const Section> sections, double side) {
  BRepOffsetAPI_ThruSections loft(Standard_True, Standard_False);
  for (Section section : sections) {
    section.x *= side;
    loft.AddWire(SectionWire(section));
  }
  loft.Build();
  return loft.Shape();
}

// The straight middle is a prism with planar sides: the plates meet it, and cutting planes is fast and exact.
TopoDS_Shape StraightBeam() {
  Section section = kStraight;
  section.x = -kStraight.x;
  const TopoDS_Face face = BRepBuilderAPI_MakeFace(SectionWire(section)).Face();
  return BRepPrimAPI_MakePrism(face, gp_Vec(2.0 * kStraight.x, 0.0, 0.0)).Shape();
}

// side is -1 (left) or +1 (right).
TopoDS_Shape Plate(double side, double width) {
  const double x = side * kPlateCentre;
  const gp_Pnt low(x - 0.5 * kPlateLength, -0.5 * width, kPlateBottom);
  const gp_Pnt high(x + 0.5 * kPlateLength, 0.5 * width, kPlateBottom + kPlateThickness);
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(low, high).Shape();
  BRepFilletAPI_MakeFillet fillet(box);
  for (TopExp_Explorer edge(box, TopAbs_EDGE); edge.More(); edge.Next()) {
    fillet.Add(kPlateFillet, TopoDS::Edge(edge.Current()));
  }
  return fillet.Shape();
}

struct EndPoint {
  double x, radius;
};

// Turns a profile, given for the right side, about x.
TopoDS_Shape Turned(std::span<const EndPoint> profile, double side) {
  BRepBuilderAPI_MakePolygon polygon;
  for (const EndPoint& p : profile) {
    polygon.Add(gp_Pnt(side * p.x, p.radius, 0.0));
  }
  polygon.Close();
  const TopoDS_Face face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face();
  return BRepPrimAPI_MakeRevol(face, gp_Ax1(gp::Origin(), gp::DX())).Shape();
}

// End cylinder with its chamfer, from the end face to the foot of the shoulder.
std::vector<EndPoint> CylinderProfile(double half_length, double radius) {
  return {{half_length, 0.0},
          {half_length, radius - kEndChamfer},
          {half_length - kEndChamfer, radius},
          {half_length - kCylinderLength, radius}};
}

std::vector<EndPoint> ShoulderProfile(double half_length, double radius) {
  const double foot = half_length - kCylinderLength;
  return {{foot, radius},
          {foot - 15.0, radius + kShoulderExcess},
          {foot - 55.0, radius + kShoulderExcess},
          {foot - 80.0, radius - kShoulderExcess},
          {foot - 80.0, 0.0}};
}

// Cylinder and shoulder as one body, so that the cylinder's face ends at a clean edge.
TopoDS_Shape End(double side, double half_length, double radius) {
  std::vector<EndPoint> profile = CylinderProfile(half_length, radius);
  const std::vector<EndPoint> shoulder = ShoulderProfile(half_length, radius);
  profile.insert(profile.end(), shoulder.begin() + 1, shoulder.end());
  return Turned(profile, side);
}

// The same in two bodies: only the cylinder needs a fine mesh.
void AppendEnd(double side, double half_length, double radius, std::vector<AxlePiece>& pieces) {
  std::vector<EndPoint> cylinder = CylinderProfile(half_length, radius);
  cylinder.push_back({cylinder.back().x, 0.0});
  std::vector<EndPoint> shoulder = ShoulderProfile(half_length, radius);
  shoulder.insert(shoulder.begin(), {shoulder.front().x, 0.0});
  pieces.push_back({Turned(cylinder, side), kCylinderChord});
  pieces.push_back({Turned(shoulder, side), kBeamChord});
}

}  // namespace

std::vector<AxlePiece> AxleMeshPieces(const AxleSize& size) {
  std::vector<AxlePiece> pieces = {{StraightBeam(), kBeamChord},
                                   {Loft(kGooseneck, -1.0), kBeamChord},
                                   {Loft(kGooseneck, +1.0), kBeamChord},
                                   {Plate(-1.0, size.left_plate_width_mm), kBeamChord},
                                   {Plate(+1.0, size.right_plate_width_mm), kBeamChord}};
  AppendEnd(-1.0, 0.5 * size.total_length_mm, 0.5 * size.left_cylinder_diameter_mm, pieces);
  AppendEnd(+1.0, 0.5 * size.total_length_mm, 0.5 * size.right_cylinder_diameter_mm, pieces);
  return pieces;
}

TopoDS_Shape AxleSolid(const AxleSize& size) {
  const double half_length = 0.5 * size.total_length_mm;
  const TopoDS_Shape bodies[] = {Loft(kGooseneck, -1.0),
                                 Loft(kGooseneck, +1.0),
                                 Plate(-1.0, size.left_plate_width_mm),
                                 Plate(+1.0, size.right_plate_width_mm),
                                 End(-1.0, half_length, 0.5 * size.left_cylinder_diameter_mm),
                                 End(+1.0, half_length, 0.5 * size.right_cylinder_diameter_mm)};
  TopoDS_Shape solid = StraightBeam();
  for (const TopoDS_Shape& body : bodies) {
    solid = BRepAlgoAPI_Fuse(solid, body).Shape();
  }
  return solid;
}

}  // namespace forgescan
