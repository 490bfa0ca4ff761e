#include <cstdio>
#include <filesystem>
#include <memory>

#include "services/common/model/bundle_file.h"
#include "services/common/model/model_import.h"
#include "tools/finite_range.h"
#include "tools/forgescan/command.h"
#include "tools/forgescan/output_files.h"

namespace forgescan {
namespace {

struct Arguments {
  std::string file, out;
  ModelImportOptions import;
};

Status Import(const Arguments& arguments) {
  const std::filesystem::path out = arguments.out.empty()
                                        ? std::filesystem::path(arguments.file).replace_extension(".bundle")
                                        : std::filesystem::path(arguments.out);
  ASSIGN_OR_RETURN(auto outputs, OutputFiles::Create({arguments.file}, {out}));
  ASSIGN_OR_RETURN(const ModelBundle bundle, LoadModel(arguments.file, arguments.import));
  RETURN_IF_ERROR(WriteBundle(bundle, outputs.Staged(out)));
  RETURN_IF_ERROR(outputs.Commit());
  std::printf("%zu faces, %zu triangles, %zu samples, resolution %.3f mm, checksum %08x\n",
              bundle.faces.size(), bundle.triangles.size(), bundle.sample_points.size(), bundle.resolution_mm,
              bundle.checksum);
  const SurfaceGridArrays& grid = bundle.grid.arrays();
  std::printf("grid of %.3g mm voxels, %.1f MB\n", static_cast<double>(grid.voxel_mm),
              4e-6 * static_cast<double>(grid.tops.size() + grid.voxels.size() + grid.lists.size()));
  for (const ModelFace& face : bundle.faces) {
    std::printf("  %-24s %-9s %7u triangles", face.name.c_str(), FaceTypeName(face.type),
                face.triangle_count);
    if (face.radius_mm > 0) std::printf("  radius %.4f mm", face.radius_mm);
    std::printf("\n");
  }
  return {};
}

}  // namespace

void AddModelCommand(CLI::App& app, Status& outcome) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("model", "Prepare design models");
  command->require_subcommand(1);
  CLI::App* import = command->add_subcommand("import", "Turn a STEP, STL or PLY file into a model bundle");
  import->add_option("file", arguments->file, "design model: .step, .stp, .stl or .ply")->required();
  import->add_option("--out", arguments->out, "the bundle to write (default: beside the file)");
  import->add_option("--spacing-mm", arguments->import.spacing_mm, "of the surface samples")
      ->capture_default_str();
  import
      ->add_option("--chord-error-mm", arguments->import.tessellation.chord_error_mm,
                   "of the triangles of a STEP file")
      ->check(FiniteRange(1e-6, 1e3))
      ->capture_default_str();
  import->callback([arguments, &outcome] { outcome = Import(*arguments); });
}

}  // namespace forgescan
