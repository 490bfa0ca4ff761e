// From a design file (STEP, STL, PLY) or a prepared bundle to a ModelBundle.
#pragma once

#include <filesystem>

#include "services/common/geometry/triangle_mesh.h"
#include "services/common/model/model_bundle.h"
#include "services/common/model/step_import.h"
#include "services/common/result.h"

namespace forgescan {

struct ModelImportOptions {
  double spacing_mm = 2;  // of the samples
  TessellationOptions tessellation;
};

// Reads .step/.stp, .stl, .ply (with faces) or .bundle (options then unused); the name's end decides.
// Errors: those of the readers; kInvalidArgument for another name.
Result<ModelBundle> LoadModel(const std::filesystem::path& path, const ModelImportOptions& options);

// A mesh without CAD faces is one freeform face called "surface". Triangles without area are dropped.
// Errors: kInvalidArgument for a mesh without area or with indices out of range, and those of
// SampleSurface().
Result<ModelBundle> ModelFromMesh(const TriangleMesh& mesh, double spacing_mm);

}  // namespace forgescan
