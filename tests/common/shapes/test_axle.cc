#include "tests/common/shapes/test_axle.h"

#include <unistd.h>

#include <BRepAdaptor_Surface.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_Printer.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "services/common/model/model_import.h"

namespace forgescan::testing {
namespace {

constexpr double kCylinderLength = 130;
constexpr double kPlateX = 500, kPlateLength = 150;

TopoDS_Shape Box(double x0, double x1, double width, double z0, double z1) {
  return BRepPrimAPI_MakeBox(gp_Pnt(x0, -width / 2, z0), gp_Pnt(x1, width / 2, z1)).Shape();
}

TopoDS_Shape Solid(const AxleSize& size) {
  const double half = size.total_length_mm / 2;
  TopoDS_Shape part = Box(-half + kCylinderLength - 1, half - kCylinderLength + 1, 70, -40, 40);
  const auto add = [&part](const TopoDS_Shape& more) { part = BRepAlgoAPI_Fuse(part, more).Shape(); };
  add(Box(-kPlateX - kPlateLength / 2, -kPlateX + kPlateLength / 2, size.left_width_mm, 25, 60));
  add(Box(kPlateX - kPlateLength / 2, kPlateX + kPlateLength / 2, size.right_width_mm, 25, 60));
  add(BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(-half, 0, 0), gp_Dir(1, 0, 0)), size.left_diameter_mm / 2,
                               kCylinderLength));
  add(BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(half, 0, 0), gp_Dir(-1, 0, 0)), size.right_diameter_mm / 2,
                               kCylinderLength));
  return part;
}

bool Near(double a, double b) { return std::abs(a - b) < 1e-6; }

std::string NameOf(const TopoDS_Face& face, const AxleSize& size) {
  const BRepAdaptor_Surface surface(face);
  if (surface.GetType() == GeomAbs_Cylinder)
    return surface.Cylinder().Location().X() < 0 ? "left_cylinder" : "right_cylinder";
  if (surface.GetType() != GeomAbs_Plane) return {};
  const gp_Pnt at = surface.Value((surface.FirstUParameter() + surface.LastUParameter()) / 2,
                                  (surface.FirstVParameter() + surface.LastVParameter()) / 2);
  if (Near(at.X(), -size.total_length_mm / 2)) return "left_end_face";
  if (Near(at.X(), size.total_length_mm / 2)) return "right_end_face";
  const std::string side = at.X() < 0 ? "left" : "right";
  const double half_width = (at.X() < 0 ? size.left_width_mm : size.right_width_mm) / 2;
  if (Near(at.Y(), half_width)) return side + "_plate_front";
  if (Near(at.Y(), -half_width)) return side + "_plate_back";
  return {};
}

Eigen::Vector3f Noisy(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, double noise_mm,
                      std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, 1);
  return point + normal * static_cast<float>(noise_mm * noise(random));
}

// A normal as it is fitted to noisy points.
Eigen::Vector3f Tilted(const Eigen::Vector3f& normal, double noise_rad, std::mt19937_64& random) {
  std::normal_distribution<float> noise(0, static_cast<float>(noise_rad));
  const Eigen::Vector3f u = normal.unitOrthogonal(), v = normal.cross(u);
  const float along_u = noise(random), along_v = noise(random);
  return (normal + along_u * u + along_v * v).normalized();
}

void AddForeignPoint(PointCloud& cloud, double noise_mm, std::mt19937_64& random) {
  std::uniform_real_distribution<float> u(0, 1);
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  Eigen::Vector3f point(2000 * u(random) - 1000, 400 * u(random) - 200, -52);
  if (u(random) < 0.3F) {  // jaws of a clamp, two millimetres above the beam's sides
    const float side = u(random) < 0.5F ? -1.0F : 1.0F;
    normal = Eigen::Vector3f(0, side, 0);
    point = Eigen::Vector3f(200 * u(random) - 100, side * (37 + 8 * u(random)), 90 * u(random) - 45);
  }
  cloud.points.push_back(Noisy(point, normal, noise_mm, random));
  cloud.normals.push_back(normal);
}

}  // namespace

Status WriteAxleStep(const AxleSize& size, const std::filesystem::path& path) {
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_Printer));
  const TopoDS_Shape part = Solid(size);
  Handle(TDocStd_Document) document;
  XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document);
  const Handle(XCAFDoc_ShapeTool) shapes = XCAFDoc_DocumentTool::ShapeTool(document->Main());
  const TDF_Label label = shapes->AddShape(part, Standard_False);
  TopTools_IndexedMapOfShape faces;
  TopExp::MapShapes(part, TopAbs_FACE, faces);
  for (int i = 1; i <= faces.Extent(); ++i) {
    const std::string name = NameOf(TopoDS::Face(faces(i)), size);
    if (!name.empty()) TDataStd_Name::Set(shapes->AddSubShape(label, faces(i)), name.c_str());
  }
  STEPCAFControl_Writer writer;
  Interface_Static::SetIVal("write.stepcaf.subshapes.name", 1);
  if (!writer.Transfer(document, STEPControl_AsIs) || writer.Write(path.c_str()) != IFSelect_RetDone) {
    return Fail(ErrorCode::kIo, "{}: cannot write the axle there", path.string());
  }
  return {};
}

Result<ModelBundle> MakeAxle(const AxleSize& size, double spacing_mm) {
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("forgescan_axle_{}.step", ::getpid());
  RETURN_IF_ERROR(WriteAxleStep(size, path));
  auto model = LoadModel(path, {spacing_mm, {}});
  std::filesystem::remove(path);
  return model;
}

std::string AxleFeatures(const std::vector<std::string>& names) {
  struct Dimension {
    const char *name, *type, *faces, *datum;
    double lower_mm, upper_mm;
  };
  constexpr std::array<Dimension, 5> kDimensions = {{
      {"total length", "length", R"("left_end_face", "right_end_face")",
       "datum = [\"left_cylinder\", \"right_cylinder\"]\n", 1887.4, 1889.4},
      {"left plate width", "width", R"("left_plate_front", "left_plate_back")", "", 178.4, 179.4},
      {"right plate width", "width", R"("right_plate_front", "right_plate_back")", "", 176.9, 177.9},
      {"left diameter", "diameter", R"("left_cylinder")", "", 89.2, 90.2},
      {"right diameter", "diameter", R"("right_cylinder")", "", 88.0, 89.0},
  }};
  std::string text = "part = \"axle\"\nreference_temperature_degc = 900.0\n";
  for (const std::string& name : names) {
    const auto* d =
        std::ranges::find_if(kDimensions, [&](const Dimension& known) { return name == known.name; });
    if (d == kDimensions.end()) throw std::invalid_argument("the test axle has no " + name);
    text += fmt::format(
        "[[dimension]]\nname = \"{}\"\ntype = \"{}\"\nfaces = [{}]\n{}lower_mm = {}\nupper_mm = {}\n",
        d->name, d->type, d->faces, d->datum, d->lower_mm, d->upper_mm);
  }
  return text;
}

PointCloud ScanOf(const ModelBundle& model, const ScanOptions& options) {
  std::mt19937_64 random(options.seed);
  std::vector<double> areas;
  for (const auto& t : model.triangles) {
    const Eigen::Vector3f a = model.vertices[t[0]];
    areas.push_back((model.vertices[t[1]] - a).cross(model.vertices[t[2]] - a).norm());
  }
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  std::uniform_real_distribution<float> u(0, 1);
  PointCloud cloud;
  while (cloud.size() < options.points) {
    if (u(random) < static_cast<float>(options.foreign_share)) {
      AddForeignPoint(cloud, options.noise_mm, random);
      continue;
    }
    const auto& t = model.triangles[pick(random)];
    const Eigen::Vector3f a = model.vertices[t[0]];
    const Eigen::Vector3f ab = model.vertices[t[1]] - a, ac = model.vertices[t[2]] - a;
    const Eigen::Vector3f normal = ab.cross(ac).normalized();
    float s = u(random), r = u(random);
    if (s + r > 1) s = 1 - s, r = 1 - r;
    if (!options.from_all_sides && normal.z() < -0.7F) continue;
    cloud.points.push_back(Noisy(a + s * ab + r * ac, normal, options.noise_mm, random));
    cloud.normals.push_back(normal);
  }
  if (options.normal_noise_rad > 0) {
    for (Eigen::Vector3f& normal : cloud.normals) normal = Tilted(normal, options.normal_noise_rad, random);
  }
  return cloud;
}

PointCloud Moved(const PointCloud& cloud, const Eigen::Isometry3d& to_from_cloud) {
  PointCloud moved = cloud;
  for (auto& p : moved.points) p = (to_from_cloud * p.cast<double>()).cast<float>();
  for (auto& n : moved.normals) n = (to_from_cloud.linear() * n.cast<double>()).cast<float>();
  return moved;
}

Eigen::Isometry3d RandomMotion(const Eigen::Vector3d& center, double angle_rad, double shift_mm,
                               std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    const double x = normal(random), y = normal(random), z = normal(random);
    return Eigen::Vector3d(x, y, z).normalized();
  };
  const Eigen::AngleAxisd turn(angle_rad, direction());
  return Eigen::Translation3d(center + shift_mm * direction()) * turn * Eigen::Translation3d(-center);
}

}  // namespace forgescan::testing
