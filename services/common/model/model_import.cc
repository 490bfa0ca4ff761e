#include "services/common/model/model_import.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>

#include "services/common/geometry/cloud_io.h"
#include "services/common/input_file.h"
#include "services/common/model/bundle_file.h"
#include "services/common/model/stl_file.h"
#include "services/common/model/surface_sampling.h"

namespace forgescan {
namespace {

constexpr float kVoxelsOfSpacing = 2;  // width of a voxel in sample spacings
constexpr float kGridMargin_mm = 64;   // beyond the part: a long part's end at the start of a registration

Result<SurfaceGrid> GridOf(const ModelBundle& bundle) {
  ASSIGN_OR_RETURN(const TriangleIndex surface, TriangleIndex::Build(bundle.vertices, bundle.triangles));
  Eigen::AlignedBox3f box;
  for (const TriangleCorners& t : bundle.triangles) {
    for (const std::uint32_t vertex : t) box.extend(bundle.vertices[vertex]);
  }
  return SurfaceGrid::Build(surface, box.min(), box.max(),
                            {kVoxelsOfSpacing * static_cast<float>(bundle.spacing_mm), kGridMargin_mm});
}

Result<ModelBundle> Finish(ModelBundle bundle, double spacing_mm) {
  ASSIGN_OR_RETURN(ModelBundle sampled, SampleSurface(std::move(bundle), spacing_mm));
  ASSIGN_OR_RETURN(sampled.grid, GridOf(sampled));
  RETURN_IF_ERROR(Check(sampled));
  // Through the file format, so that an imported model and the same model read back are equal in every byte.
  return DecodeBundle(EncodeBundle(sampled));
}

// What is made of a file's content knows no file; its error then gets the name.
Result<ModelBundle> Named(Result<ModelBundle> bundle, const std::filesystem::path& path) {
  if (bundle.ok()) return bundle;
  return Fail(bundle.error().code, "{}: {}", path.string(), bundle.error().message);
}

Result<ModelBundle> LoadStl(const std::filesystem::path& path, double spacing_mm) {
  ASSIGN_OR_RETURN(const std::string bytes, ReadInputFile(path));
  const auto mesh = DecodeStl(bytes);
  return Named(mesh.ok() ? ModelFromMesh(*mesh, spacing_mm) : mesh.error(), path);
}

}  // namespace

Result<ModelBundle> ModelFromMesh(const TriangleMesh& mesh, double spacing_mm) {
  ModelBundle bundle;
  bundle.vertices = mesh.vertices;
  for (const TriangleCorners& t : mesh.triangles) {
    if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) {
      return Fail(ErrorCode::kInvalidArgument, "a mesh triangle names a vertex beyond the {} there are",
                  mesh.vertices.size());
    }
    const Eigen::Vector3f& a = mesh.vertices[t[0]];
    if ((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm() > 0) bundle.triangles.push_back(t);
  }
  ModelFace surface;
  surface.name = "surface";
  surface.triangle_count = static_cast<std::uint32_t>(bundle.triangles.size());
  bundle.faces.push_back(surface);
  return Finish(std::move(bundle), spacing_mm);
}

Result<ModelBundle> LoadModel(const std::filesystem::path& path, const ModelImportOptions& options) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  if (suffix == ".bundle") return ReadBundle(path);
  if (suffix == ".stl") return LoadStl(path, options.spacing_mm);
  if (suffix == ".ply") {
    ASSIGN_OR_RETURN(const TriangleMesh mesh, ReadTriangleMesh(path));
    return Named(ModelFromMesh(mesh, options.spacing_mm), path);
  }
  if (suffix == ".step" || suffix == ".stp") {
    ASSIGN_OR_RETURN(ModelBundle bundle, ReadStep(path, options.tessellation));
    return Named(Finish(std::move(bundle), options.spacing_mm), path);
  }
  return Fail(ErrorCode::kInvalidArgument, "{}: a model is a .step, .stp, .stl, .ply or .bundle file",
              path.string());
}

}  // namespace forgescan
