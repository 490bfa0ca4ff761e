#include "services/common/model/step_import.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Eigen/Geometry>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <map>
#include <set>

namespace forgescan {
namespace {

Eigen::Vector3d ToEigen(const gp_XYZ& v) { return {v.X(), v.Y(), v.Z()}; }

void SetAxis(ModelFace& face, const gp_Ax1& axis, double radius_mm) {
  face.point = ToEigen(axis.Location().XYZ());
  face.direction = ToEigen(axis.Direction().XYZ());
  face.radius_mm = radius_mm;
}

void SetNominal(ModelFace& face, const TopoDS_Face& shape) {
  const BRepAdaptor_Surface surface(shape);
  switch (surface.GetType()) {
    case GeomAbs_Plane:
      face.type = FaceType::kPlane;
      return SetAxis(face, surface.Plane().Axis(), 0);
    case GeomAbs_Cylinder:
      face.type = FaceType::kCylinder;
      return SetAxis(face, surface.Cylinder().Axis(), surface.Cylinder().Radius());
    case GeomAbs_Cone:
      face.type = FaceType::kCone;
      return SetAxis(face, surface.Cone().Axis(), 0);
    case GeomAbs_Torus:
      face.type = FaceType::kTorus;
      return SetAxis(face, surface.Torus().Axis(), surface.Torus().MajorRadius());
    case GeomAbs_Sphere:
      face.type = FaceType::kSphere;
      face.point = ToEigen(surface.Sphere().Location().XYZ());
      face.radius_mm = surface.Sphere().Radius();
      return;
    default:
      return;
  }
}

// The name the file gives the face (ADVANCED_FACE's label), or nothing.
std::string NameInFile(const STEPControl_Reader& reader, const TopoDS_Face& shape) {
  const Handle(XSControl_TransferReader) transfer = reader.WS()->TransferReader();
  for (const TopoDS_Shape& candidate : {TopoDS_Shape(shape), shape.Located(TopLoc_Location())}) {
    const auto item =
        Handle(StepRepr_RepresentationItem)::DownCast(transfer->EntityFromShapeResult(candidate, 1));
    if (item.IsNull() || item->Name().IsNull()) continue;
    const std::string name = item->Name()->ToCString();
    if (!name.empty() && name != "NONE") return name;
  }
  return {};
}

// Appends the face's triangles; nodes at the same place (the seam of a closed cylinder) become one vertex.
Status AppendTriangles(ModelBundle& bundle, ModelFace& face, const TopoDS_Face& shape) {
  TopLoc_Location location;
  const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(shape, location);
  if (mesh.IsNull() || mesh->NbTriangles() == 0) {
    return Fail(ErrorCode::kDegenerate, "face '{}' cannot be triangulated", face.name);
  }
  std::map<std::array<float, 3>, std::uint32_t> known;
  std::vector<std::uint32_t> vertex_of(static_cast<std::size_t>(mesh->NbNodes()) + 1);
  for (int i = 1; i <= mesh->NbNodes(); ++i) {
    const Eigen::Vector3f p =
        ToEigen(mesh->Node(i).Transformed(location.Transformation()).XYZ()).cast<float>();
    const auto [it, is_new] =
        known.insert({{p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(bundle.vertices.size())});
    if (is_new) bundle.vertices.push_back(p);
    vertex_of[static_cast<std::size_t>(i)] = it->second;
  }
  face.first_triangle = static_cast<std::uint32_t>(bundle.triangles.size());
  face.triangle_count = static_cast<std::uint32_t>(mesh->NbTriangles());
  for (int i = 1; i <= mesh->NbTriangles(); ++i) {
    std::array<int, 3> n{};
    mesh->Triangle(i).Get(n[0], n[1], n[2]);
    if (shape.Orientation() == TopAbs_REVERSED) std::swap(n[1], n[2]);
    TriangleCorners corners{};
    for (std::size_t k = 0; k < 3; ++k) corners[k] = vertex_of[static_cast<std::size_t>(n[k])];
    bundle.triangles.push_back(corners);
  }
  return {};
}

// A plane's own normal may point into the part; its triangles know the outside.
void PointOutwards(const ModelBundle& bundle, ModelFace& face) {
  if (face.type != FaceType::kPlane) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::uint32_t i = face.first_triangle; i < face.first_triangle + face.triangle_count; ++i) {
    const TriangleCorners& t = bundle.triangles[i];
    const Eigen::Vector3d a = bundle.vertices[t[0]].cast<double>();
    sum += (bundle.vertices[t[1]].cast<double>() - a).cross(bundle.vertices[t[2]].cast<double>() - a);
  }
  if (sum.dot(face.direction) < 0) face.direction = -face.direction;
}

std::string UniqueName(const std::string& wanted, const std::string& type, std::set<std::string>& used) {
  std::string name = wanted;
  for (int number = wanted.empty() ? 1 : 2; name.empty() || used.contains(name); ++number) {
    name = fmt::format("{}_{}", wanted.empty() ? type : wanted, number);
  }
  used.insert(name);
  return name;
}

Result<ModelBundle> Convert(const STEPControl_Reader& reader, const TopoDS_Shape& shape) {
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  if (faces.IsEmpty()) return Fail(ErrorCode::kFormat, "the STEP file has no faces");
  ModelBundle bundle;
  std::set<std::string> used;
  for (int i = 1; i <= faces.Extent(); ++i) {
    const TopoDS_Face& one = TopoDS::Face(faces(i));
    ModelFace face;
    SetNominal(face, one);
    face.name = UniqueName(NameInFile(reader, one), FaceTypeName(face.type), used);
    RETURN_IF_ERROR(AppendTriangles(bundle, face, one));
    PointOutwards(bundle, face);
    bundle.faces.push_back(std::move(face));
  }
  return bundle;
}

Result<ModelBundle> ReadWithOcct(const std::filesystem::path& path, const TessellationOptions& options) {
  // OpenCASCADE reports progress on standard output, which belongs to our callers.
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  STEPControl_Reader reader;
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone || reader.TransferRoots() == 0) {
    return Fail(ErrorCode::kFormat, "not a STEP file with geometry");
  }
  const TopoDS_Shape shape = reader.OneShape();
  if (shape.IsNull()) return Fail(ErrorCode::kFormat, "the STEP file has no shape");
  const BRepMesh_IncrementalMesh mesher(shape, options.chord_error_mm, false, options.angle_rad, false);
  if (!mesher.IsDone()) return Fail(ErrorCode::kDegenerate, "the STEP file's shape cannot be triangulated");
  ASSIGN_OR_RETURN(ModelBundle bundle, Convert(reader, shape));
  bundle.chord_error_mm = options.chord_error_mm;
  return bundle;
}

}  // namespace

Result<ModelBundle> ReadStep(const std::filesystem::path& path, const TessellationOptions& options) {
  if (!std::filesystem::is_regular_file(path)) {
    return Fail(ErrorCode::kNotFound, "{}: no such file", path.string());
  }
  if (!(options.chord_error_mm > 0) || !(options.angle_rad > 0)) {
    return Fail(ErrorCode::kInvalidArgument,
                "a chord error of {} mm and an angle of {} rad, both must be > 0", options.chord_error_mm,
                options.angle_rad);
  }
  try {
    auto bundle = ReadWithOcct(path, options);
    if (bundle.ok()) return bundle;
    return Fail(bundle.error().code, "{}: {}", path.string(), bundle.error().message);
  } catch (const Standard_Failure& failure) {
    return Fail(ErrorCode::kFormat, "{}: OpenCASCADE cannot use it: {}", path.string(),
                failure.GetMessageString());
  }
}

}  // namespace forgescan
