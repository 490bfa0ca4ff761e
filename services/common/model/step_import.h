// STEP files through OpenCASCADE. The only header that knows of STEP; OpenCASCADE itself stays in the .cc.
#pragma once

#include <filesystem>

#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

struct TessellationOptions {
  double chord_error_mm = 0.005;  // largest distance of a triangle from its CAD face
  double angle_rad = 0.2;         // largest angle between neighbouring triangles of a curved face
};

// Every face of every solid or shell becomes one ModelFace with its triangles; names of the file's faces are
// kept. The samples are left empty: SampleSurface() fills them. Units: mm, whatever unit the file is in.
// Frames: the file's own. Errors: kNotFound; kFormat for a file OpenCASCADE cannot read or without faces;
// kDegenerate for a face that cannot be triangulated.
Result<ModelBundle> ReadStep(const std::filesystem::path& path, const TessellationOptions& options);

}  // namespace forgescan
