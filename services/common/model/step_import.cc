#include "services/common/model/step_import.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <Eigen/Geometry>
#include <Interface_Check.hxx>
#include <Interface_CheckIterator.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <Poly_Triangulation.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <StepData_StepModel.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepShape_FaceSurface.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Face.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <exception>
#include <map>
#include <set>

namespace forgescan {
namespace {

// The largest side of a part's box. Outside, the file's length unit is not what it says.
constexpr double kLeastPartMm = 0.1;
constexpr double kLargestPartMm = 20'000;

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

// What OpenCASCADE itself found wrong; it goes on without the entities concerned.
Status CheckMessages(Interface_CheckIterator checks, const char* when) {
  for (checks.Start(); checks.More(); checks.Next()) {
    const Handle(Interface_Check) check = checks.Value();
    if (check->NbFails() == 0) continue;
    return Fail(ErrorCode::kFormat, "entity {} of the STEP file cannot be {}: {}", checks.Number(), when,
                check->CFail(1));
  }
  return {};
}

// Every face the file lists must have arrived: a part with a face missing measures wrong.
Status CheckFaces(const Handle(StepData_StepModel) & model, const TopoDS_Shape& shape) {
  int listed = 0;
  for (int i = 1; i <= model->NbEntities(); ++i) {
    if (model->Value(i)->IsKind(STANDARD_TYPE(StepShape_FaceSurface))) ++listed;
  }
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(shape, TopAbs_FACE, faces);
  if (faces.IsEmpty()) return Fail(ErrorCode::kFormat, "the STEP file has no faces");
  if (faces.Extent() >= listed) return {};
  return Fail(ErrorCode::kFormat, "only {} of the {} faces in the STEP file have a usable shape",
              faces.Extent(), listed);
}

Status CheckClosed(const TopoDS_Shape& shape) {
  int number = 0;
  for (TopExp_Explorer shells(shape, TopAbs_SHELL); shells.More(); shells.Next()) {
    ++number;
    if (BRep_Tool::IsClosed(shells.Current())) continue;
    return Fail(ErrorCode::kFormat, "shell {} of the STEP file is open, a part must be closed", number);
  }
  if (number > 0 && !TopExp_Explorer(shape, TopAbs_FACE, TopAbs_SHELL).More()) return {};
  return Fail(ErrorCode::kFormat, "the STEP file has faces that belong to no closed shell");
}

// Before the triangles: their number grows with the size of the part.
Status CheckSize(const TopoDS_Shape& shape) {
  Bnd_Box box;
  BRepBndLib::Add(shape, box);
  if (box.IsVoid()) return Fail(ErrorCode::kFormat, "the STEP file's shape has no extent");
  const gp_XYZ side = box.CornerMax().XYZ() - box.CornerMin().XYZ();
  const double largest_mm = std::max({side.X(), side.Y(), side.Z()});
  if (largest_mm >= kLeastPartMm && largest_mm <= kLargestPartMm) return {};
  return Fail(ErrorCode::kFormat,
              "the part in the STEP file is {:.4g} mm long, allowed {} to {} mm: the file's unit is wrong",
              largest_mm, kLeastPartMm, kLargestPartMm);
}

Result<TopoDS_Shape> TransferShape(STEPControl_Reader& reader, const std::filesystem::path& path) {
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) {
    return Fail(ErrorCode::kFormat, "not a STEP file with geometry");
  }
  RETURN_IF_ERROR(CheckMessages(reader.WS()->ModelCheckList(), "read"));
  if (reader.TransferRoots() == 0) return Fail(ErrorCode::kFormat, "not a STEP file with geometry");
  RETURN_IF_ERROR(CheckMessages(reader.WS()->TransferReader()->LastCheckList(), "turned into a shape"));
  TopoDS_Shape shape = reader.OneShape();
  if (shape.IsNull()) return Fail(ErrorCode::kFormat, "the STEP file has no shape");
  RETURN_IF_ERROR(CheckFaces(reader.StepModel(), shape));
  RETURN_IF_ERROR(CheckClosed(shape));
  RETURN_IF_ERROR(CheckSize(shape));
  return shape;
}

Result<ModelBundle> ReadWithOcct(const std::filesystem::path& path, const TessellationOptions& options) {
  // OpenCASCADE reports progress on standard output, which belongs to our callers.
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  STEPControl_Reader reader;
  ASSIGN_OR_RETURN(const TopoDS_Shape shape, TransferShape(reader, path));
  const BRepMesh_IncrementalMesh mesher(shape, options.chord_error_mm, false, options.angle_rad, false);
  if (!mesher.IsDone()) return Fail(ErrorCode::kDegenerate, "the STEP file's shape cannot be triangulated");
  ASSIGN_OR_RETURN(ModelBundle bundle, Convert(reader, shape));
  bundle.chord_error_mm = options.chord_error_mm;
  return bundle;
}

}  // namespace

Result<ModelBundle> ReadStep(const std::filesystem::path& path, const TessellationOptions& options) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(path, problem)) {
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
  } catch (const std::exception& failure) {
    return Fail(ErrorCode::kFormat, "{}: OpenCASCADE cannot use it: {}", path.string(), failure.what());
  }
}

}  // namespace forgescan
