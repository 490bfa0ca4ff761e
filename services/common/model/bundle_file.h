// The model bundle as one binary file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "services/common/model/model_bundle.h"
#include "services/common/result.h"

namespace forgescan {

// Layout, little endian: "FSBUNDLE", u32 version, u32 CRC-32 of the payload, u64 payload bytes, payload
// (sampling, grid, faces, triangles, samples; arrays preceded by their u64 count).
std::string EncodeBundle(const ModelBundle& bundle);

// Errors: kFormat for a wrong magic, version, length, checksum or count; kInvalidArgument from
// Check(ModelBundle).
Result<ModelBundle> DecodeBundle(const std::string& bytes);

// A file is whole or not there, a pipe or device is written directly (output_file.h). Errors: kIo.
Status WriteBundle(const ModelBundle& bundle, const std::filesystem::path& path);
// Maps the file read-only and keeps it mapped as long as the bundle's grid is in use: several services then
// share one copy. Errors: kNotFound, kIo, kFormat (also for a bundle of an older version), kInvalidArgument.
Result<ModelBundle> ReadBundle(const std::filesystem::path& path);

}  // namespace forgescan
