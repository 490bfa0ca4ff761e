// Design models: STEP, STL, PLY, bundles, and the features of a part.
#include <libdeflate.h>

#include <cmath>
#include <cstring>

#include "services/common/input_file.h"
#include "services/common/model/bundle_file.h"
#include "services/common/model/features.h"
#include "services/common/model/model_import.h"
#include "services/common/model/stl_file.h"
#include "tests/common/shapes/test_axle.h"
#include "tests/fuzz/readers.h"

namespace forgescan::fuzz {
namespace {

constexpr std::size_t kBundleHeaderBytes = 24;  // magic, version, CRC-32, bytes of payload

const std::string& AxleStep() {
  static const std::string text = [] {
    const std::string path = ScratchFile("axle.step", "");
    return testing::WriteAxleStep({}, path).ok() ? ReadInputFile(path).value() : std::string();
  }();
  return text;
}

// Coarse, so that a run takes milliseconds.
const ModelBundle& Axle() {
  static const ModelBundle bundle = [] {
    return LoadModel(ScratchFile("seed.step", AxleStep()), {100, {1, 0.8}}).value();
  }();
  return bundle;
}

std::string BundleProblem(const ModelBundle& bundle) {
  for (const ModelFace& face : bundle.faces) {
    if (!std::isfinite(face.radius_mm) || !face.point.allFinite()) return "a face that is not finite";
    if (std::uint64_t{face.first_triangle} + face.triangle_count > bundle.triangles.size()) {
      return "a face with triangles that are not there";
    }
  }
  if (!std::isfinite(bundle.spacing_mm) || !std::isfinite(bundle.resolution_mm))
    return "a spacing not finite";
  return ProblemOf(Check(bundle));
}

Outcome ReadModel(const char* name, const std::string& bytes) {
  return Judge(LoadModel(ScratchFile(name, bytes), {100, {1, 0.8}}), name, BundleProblem);
}

// As somebody writes it who knows the format: length and checksum are right.
std::string Mended(std::string bytes) {
  if (bytes.size() < kBundleHeaderBytes) return bytes;
  const std::uint64_t payload = bytes.size() - kBundleHeaderBytes;
  const std::uint32_t crc = libdeflate_crc32(0, bytes.data() + kBundleHeaderBytes, payload);
  std::memcpy(bytes.data() + 12, &crc, sizeof crc);
  std::memcpy(bytes.data() + 16, &payload, sizeof payload);
  return bytes;
}

std::string BinaryStl() {
  std::string bytes(80, ' ');
  const std::uint32_t count = 2;
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (const float shift : {0.F, 40.F}) {
    const std::array<float, 12> numbers = {0, 0, 1, shift, 0, 0, shift + 500, 0, 0, shift, 600, 0};
    bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
    bytes.append(2, '\0');
  }
  return bytes;
}

constexpr char kAsciiStl[] =
    "solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 500 0 0\nvertex 0 +6e2 0\nendloop\n"
    "endfacet\nendsolid part\n";
constexpr char kPlyModel[] =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n500 0 0\n500 500 0\n0 500 0\n3 0 1 2\n4 0 1 2 3\n";
constexpr char kFeatures[] = R"(part = "axle"
reference_temperature_degc = 900.0
[[dimension]]
name = "total length"
type = "length"
faces = ["left_end_face", "right_end_face"]
datum = ["left_cylinder", "right_cylinder"]
lower_mm = 1887.0
upper_mm = 1889.5
[[dimension]]
name = "diameter"
type = "diameter"
faces = ["left_cylinder"]
lower_mm = 89.0
upper_mm = 91.0
expanded_uncertainty_mm = 0.05
)";

std::string FeaturesProblem(const Features& features) {
  for (const DimensionSpec& spec : features.dimensions) {
    if (!(std::isfinite(spec.upper_mm) && spec.lower_mm > 0 && spec.upper_mm > spec.lower_mm))
      return "limits";
    if (spec.faces.empty() || spec.name.empty()) return "a dimension without name or faces";
  }
  const auto bound = BindFeatures(features, Axle());
  return bound.ok() ? "" : SentenceProblem(bound.error(), "");
}

}  // namespace

std::vector<Reader> Readers() {
  const auto model = [](const char* name) {
    return [name](const std::string& bytes) { return ReadModel(name, bytes); };
  };
  const auto mended = [](const std::string& bytes) {
    return Judge(DecodeBundle(Mended(bytes)), "", BundleProblem);
  };
  const auto features = [](const std::string& bytes) {
    return Judge(ParseFeatures(bytes, "features.toml"), "features.toml", FeaturesProblem);
  };
  const std::string bundle = EncodeBundle(Axle());
  return {{"stl", 5000, {kAsciiStl, BinaryStl()}, model("model.stl")},
          {"ply_model", 4000, {kPlyModel}, model("model.ply")},
          {"bundle", 1000, {bundle}, model("model.bundle")},
          {"bundle_mended", 10'000, {bundle}, mended},
          {"step", 40, {AxleStep()}, model("model.step")},
          {"features", 10'000, {kFeatures}, features}};
}

}  // namespace forgescan::fuzz
