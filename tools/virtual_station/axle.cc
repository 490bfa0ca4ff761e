#include "tools/virtual_station/axle.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepGProp.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <StlAPI_Writer.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <cmath>
#include <cstdio>

#include "tools/virtual_station/axle_shape.h"

namespace forgescan {
namespace {

constexpr double kStlChord = 0.05;
constexpr double kAngularDeflection = 0.2;  // rad

void AppendFace(const TopoDS_Face& face, SurfaceMesh& mesh) {
  TopLoc_Location place;
  const Handle(Poly_Triangulation) triangulation = BRep_Tool::Triangulation(face, place);
  if (triangulation.IsNull()) {
    throw Standard_Failure("a face of the axle was left without triangles");
  }
  const int first = static_cast<int>(mesh.vertices.size());
  for (int i = 1; i <= triangulation->NbNodes(); ++i) {
    const gp_Pnt p = triangulation->Node(i).Transformed(place.Transformation());
    mesh.vertices.emplace_back(p.X(), p.Y(), p.Z());
  }
  for (int i = 1; i <= triangulation->NbTriangles(); ++i) {
    int a = 0, b = 0, c = 0;
    triangulation->Triangle(i).Get(a, b, c);
    if (face.Orientation() == TopAbs_REVERSED) {
      std::swap(b, c);
    }
    mesh.triangles.push_back({first + a - 1, first + b - 1, first + c - 1});
  }
}

// The name of a face, or "" for one without: dimensions are bound to planes and cylinders found by type and
// place.
std::string FaceName(const TopoDS_Face& face, const AxleSize& size) {
  const BRepAdaptor_Surface surface(face);
  GProp_GProps properties;
  BRepGProp::SurfaceProperties(face, properties);
  const gp_Pnt centre = properties.CentreOfMass();
  const std::string side = centre.X() < 0 ? "left_" : "right_";
  constexpr double kSame = 1e-6;  // mm: positions are copied, not computed
  if (surface.GetType() == GeomAbs_Cylinder) {
    const double diameter = centre.X() < 0 ? size.left_cylinder_diameter_mm : size.right_cylinder_diameter_mm;
    const bool coaxial = std::abs(surface.Cylinder().Axis().Direction().X()) > 1.0 - 1e-12;
    const bool same = std::abs(2.0 * surface.Cylinder().Radius() - diameter) < kSame;
    return coaxial && same ? side + "cylinder" : "";
  }
  if (surface.GetType() != GeomAbs_Plane) {
    return "";
  }
  if (std::abs(std::abs(centre.X()) - 0.5 * size.total_length_mm) < kSame) {
    return side + "end_face";
  }
  const double width = centre.X() < 0 ? size.left_plate_width_mm : size.right_plate_width_mm;
  if (std::abs(std::abs(centre.Y()) - 0.5 * width) < kSame) {
    return side + (centre.Y() > 0 ? "plate_front" : "plate_back");
  }
  return "";
}

void NameFaces(const TopoDS_Shape& solid, const AxleSize& size, const Handle(XCAFDoc_ShapeTool) & shapes) {
  const TDF_Label root = shapes->AddShape(solid, Standard_False);
  TDataStd_Name::Set(root, "axle");
  for (TopExp_Explorer face(solid, TopAbs_FACE); face.More(); face.Next()) {
    const std::string name = FaceName(TopoDS::Face(face.Current()), size);
    if (!name.empty()) {
      TDataStd_Name::Set(shapes->AddSubShape(root, face.Current()), name.c_str());
    }
  }
}

bool WriteStepFile(const TopoDS_Shape& solid, const AxleSize& size, const std::string& path) {
  Handle(TDocStd_Document) document;
  const Handle(XCAFApp_Application) application = XCAFApp_Application::GetApplication();
  application->NewDocument("BinXCAF", document);
  NameFaces(solid, size, XCAFDoc_DocumentTool::ShapeTool(document->Main()));
  STEPCAFControl_Writer writer;
  writer.SetNameMode(Standard_True);
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetIVal("write.stepcaf.subshapes.name", 1);
  // The STEP writer reports its progress on stdout, which belongs to the program.
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  const bool written =
      writer.Transfer(document, STEPControl_AsIs) && writer.Write(path.c_str()) == IFSelect_RetDone;
  application->Close(document);
  return written;
}

Status MoveIntoPlace(bool written, const std::string& temporary, const std::string& path) {
  if (!written || std::rename(temporary.c_str(), path.c_str()) != 0) {
    std::remove(temporary.c_str());
    return Fail(ErrorCode::kIo, "{}: the axle could not be written there", path);
  }
  return {};
}

Error Broken(const Standard_Failure& failure) {
  return Fail(ErrorCode::kDegenerate, "the shape of the axle cannot be built: {}",
              failure.GetMessageString());
}

}  // namespace

Status Check(const AxleSize& size) {
  const AxleSize design_size;
  for (const AxleDimension& dimension : kAxleDimensions) {
    const double value = size.*dimension.size_mm;
    const double design = design_size.*dimension.size_mm;
    if (!(std::abs(value / design - 1.0) <= 0.05)) {
      return Fail(ErrorCode::kInvalidArgument, "axle: {} is {} mm, allowed {} to {} mm", dimension.name,
                  value, 0.95 * design, 1.05 * design);
    }
  }
  return {};
}

std::vector<std::string> AxleFaceNames() {
  return {"left_end_face",  "left_cylinder",  "left_plate_front",  "left_plate_back",
          "right_end_face", "right_cylinder", "right_plate_front", "right_plate_back"};
}

Result<SurfaceMesh> BuildAxleMesh(const AxleSize& size) {
  RETURN_IF_ERROR(Check(size));
  try {
    SurfaceMesh mesh_in_part;
    for (const AxlePiece& piece : AxleMeshPieces(size)) {
      const BRepMesh_IncrementalMesh mesher(piece.shape, piece.chord_mm, Standard_False, kAngularDeflection);
      for (TopExp_Explorer face(piece.shape, TopAbs_FACE); face.More(); face.Next()) {
        AppendFace(TopoDS::Face(face.Current()), mesh_in_part);
      }
    }
    return mesh_in_part;
  } catch (const Standard_Failure& failure) {
    return Broken(failure);
  }
}

Status WriteAxleStep(const AxleSize& size, const std::string& path) {
  RETURN_IF_ERROR(Check(size));
  try {
    const std::string temporary = path + ".part";
    return MoveIntoPlace(WriteStepFile(AxleSolid(size), size, temporary), temporary, path);
  } catch (const Standard_Failure& failure) {
    return Broken(failure);
  }
}

Status WriteAxleStl(const AxleSize& size, const std::string& path) {
  RETURN_IF_ERROR(Check(size));
  try {
    const TopoDS_Shape solid = AxleSolid(size);
    const BRepMesh_IncrementalMesh mesher(solid, kStlChord, Standard_False, kAngularDeflection);
    StlAPI_Writer writer;
    writer.ASCIIMode() = Standard_False;
    const std::string temporary = path + ".part";
    return MoveIntoPlace(writer.Write(solid, temporary.c_str()), temporary, path);
  } catch (const Standard_Failure& failure) {
    return Broken(failure);
  }
}

}  // namespace forgescan
