#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>

#include "services/common/model/bundle_file.h"
#include "services/common/model/model_import.h"
#include "services/common/model/stl_file.h"
#include "services/common/model/surface_sampling.h"
#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

// A box of 20 x 10 x 6 mm about the origin.
TriangleMesh BoxMesh() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back((i & 1) != 0 ? 10.0F : -10.0F, (i & 2) != 0 ? 5.0F : -5.0F,
                               (i & 4) != 0 ? 3.0F : -3.0F);
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

std::string BinaryStl(const TriangleMesh& mesh) {
  std::string bytes(80, 's');
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& t : mesh.triangles) {
    bytes.append(12, '\0');
    for (const auto v : t) bytes.append(reinterpret_cast<const char*>(mesh.vertices[v].data()), 12);
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string AsciiStl(const TriangleMesh& mesh) {
  std::string text = "solid box\n";
  for (const auto& t : mesh.triangles) {
    text += "facet normal 0 0 0\n outer loop\n";
    for (const auto v : t) {
      const auto& p = mesh.vertices[v];
      text += fmt::format("  vertex {:e} {:e} {:e}\n", p.x(), p.y(), p.z());
    }
    text += " endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

TEST(ModelTest, Starts) { EXPECT_TRUE(ModelFromMesh(BoxMesh(), 1).ok()); }

TEST(ModelTest, SamplesAreEvenOnTheSurfaceAndRepeatable) {
  const auto model = ModelFromMesh(BoxMesh(), 0.5);
  ASSERT_TRUE(model.ok()) << model.error().message;
  const double area_mm2 = 2 * (20 * 10 + 10 * 6 + 6 * 20);
  EXPECT_NEAR(static_cast<double>(model->sample_points.size()), area_mm2 / 0.25, 1);
  std::size_t on_top = 0;
  for (std::size_t i = 0; i < model->sample_points.size(); ++i) {
    const Eigen::Vector3f& p = model->sample_points[i];
    const Eigen::Vector3f beyond = p.cwiseAbs() - Eigen::Vector3f(10, 5, 3);
    EXPECT_NEAR(beyond.maxCoeff(), 0, 1e-5);  // mm, single precision
    EXPECT_GT(model->sample_normals[i].dot(p), 0) << "inward normal";
    on_top += model->sample_normals[i].z() > 0.5F ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(on_top), 200 / 0.25, 2);
  // A random set has r = 0.5 spacing, a square grid 1.
  EXPECT_GT(model->resolution_mm, 0.25);
  EXPECT_LT(model->resolution_mm, 0.5);
  EXPECT_EQ(EncodeBundle(*ModelFromMesh(BoxMesh(), 0.5)), EncodeBundle(*model));
}

TEST(ModelTest, ResolutionIsTheMeanNearestDistance) {
  std::vector<Eigen::Vector3f> grid;
  for (int i = 0; i < 400; ++i)
    grid.emplace_back(static_cast<float>(2 * (i % 20)), static_cast<float>(2 * (i / 20)), 0.0F);
  EXPECT_NEAR(MeanNearestDistance(grid, 2), 2, 1e-6);
  EXPECT_EQ(MeanNearestDistance({{0, 0, 0}}, 2), 0);
}

TEST(ModelTest, BundleComesBackEqualAndDamageIsSeen) {
  const auto model = ModelFromMesh(BoxMesh(), 1);
  ASSERT_TRUE(model.ok());
  const std::string bytes = EncodeBundle(*model);
  const auto back = DecodeBundle(bytes);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(EncodeBundle(*back), bytes);
  EXPECT_EQ(back->checksum, model->checksum);
  for (std::size_t at = 0; at < bytes.size(); at += 7) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    EXPECT_FALSE(DecodeBundle(damaged).ok()) << "byte " << at;
  }
  for (std::size_t size = 0; size < bytes.size(); size += 101)
    EXPECT_FALSE(DecodeBundle(bytes.substr(0, size)).ok());
  EXPECT_FALSE(DecodeBundle(bytes + "x").ok());
}

TEST(ModelTest, ABundleReadFromAFileUsesTheMappedGrid) {
  const auto model = ModelFromMesh(BoxMesh(), 1);
  ASSERT_TRUE(model.ok());
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("forgescan_grid_{}.bundle", ::getpid());
  ASSERT_TRUE(WriteBundle(*model, path).ok());
  auto read = ReadBundle(path);
  // Replaced as WriteBundle does it: what is mapped stays as it was.
  ASSERT_TRUE(WriteBundle(*ModelFromMesh(BoxMesh(), 2), path).ok());
  std::filesystem::remove(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(EncodeBundle(*read), EncodeBundle(*model));
  const SurfaceGrid copy = read->grid;
  read = Fail(ErrorCode::kNotFound, "gone");  // the copy keeps the file mapped
  EXPECT_TRUE(Check(copy.arrays(), model->triangles.size()).ok());
  EXPECT_EQ(ReadBundle(path).error().code, ErrorCode::kNotFound);
}

TEST(ModelTest, ABundleOfAnOlderVersionSaysWhatToDo) {
  std::string bytes = EncodeBundle(*ModelFromMesh(BoxMesh(), 1));
  bytes[8] = 1;  // the version follows the eight letters
  const auto old = DecodeBundle(bytes);
  ASSERT_FALSE(old.ok());
  EXPECT_EQ(old.error().code, ErrorCode::kFormat);
  EXPECT_NE(old.error().message.find("prepare the model anew"), std::string::npos) << old.error().message;
}

TEST(ModelTest, ReadsBothKindsOfStl) {
  for (const std::string& bytes : {BinaryStl(BoxMesh()), AsciiStl(BoxMesh())}) {
    const auto mesh = DecodeStl(bytes);
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    EXPECT_EQ(mesh->vertices.size(), 8U);
    ASSERT_EQ(mesh->triangles.size(), 12U);
    const auto model = ModelFromMesh(*mesh, 1);
    ASSERT_TRUE(model.ok());
    EXPECT_EQ(model->sample_points.size(), 760U);
  }
}

TEST(ModelTest, RefusesStlThatIsNotWhole) {
  const std::string binary = BinaryStl(BoxMesh()), ascii = AsciiStl(BoxMesh());
  EXPECT_FALSE(DecodeStl(binary.substr(0, binary.size() - 1)).ok());
  EXPECT_FALSE(DecodeStl(ascii.substr(0, ascii.size() / 2)).ok());
  EXPECT_FALSE(DecodeStl("solid nothing\nendsolid nothing\n").ok());
  EXPECT_FALSE(DecodeStl("solid x\nvertex 1 2 three\nendsolid").ok());
  EXPECT_FALSE(DecodeStl("").ok());
  TriangleMesh bad = BoxMesh();
  bad.vertices[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(DecodeStl(BinaryStl(bad)).error().code, ErrorCode::kFormat);
}

TEST(ModelTest, StepKeepsFaceNamesAndNominalSizes) {
  const auto model = testing::MakeAxle({}, 5);
  ASSERT_TRUE(model.ok()) << model.error().message;
  for (const char* name : {"left_end_face", "right_end_face", "left_plate_front", "left_plate_back",
                           "right_plate_front", "right_plate_back"}) {
    const auto face = FindFace(*model, name);
    ASSERT_TRUE(face.ok()) << face.error().message;
    EXPECT_EQ(model->faces[*face].type, FaceType::kPlane);
    EXPECT_GT(model->faces[*face].direction.dot(model->faces[*face].point), 0) << name << " points inwards";
  }
  const auto cylinder = FindFace(*model, "right_cylinder");
  ASSERT_TRUE(cylinder.ok()) << cylinder.error().message;
  EXPECT_EQ(model->faces[*cylinder].type, FaceType::kCylinder);
  EXPECT_NEAR(model->faces[*cylinder].radius_mm, 44.25, 1e-6);
  EXPECT_NEAR(std::abs(model->faces[*cylinder].direction.x()), 1, 1e-9);
  EXPECT_FALSE(FindFace(*model, "no such face").ok());
  EXPECT_TRUE(FindFace(*model, "plane_1").ok());  // the unnamed ones
}

TEST(ModelTest, StepTrianglesFaceOutwardsAndHoldTheChordError) {
  const auto model = testing::MakeAxle({}, 5);
  ASSERT_TRUE(model.ok());
  double volume_mm3 = 0;
  for (const auto& t : model->triangles) {
    const Eigen::Vector3d a = model->vertices[t[0]].cast<double>(), b = model->vertices[t[1]].cast<double>();
    volume_mm3 += a.dot(b.cross(model->vertices[t[2]].cast<double>())) / 6;
  }
  EXPECT_GT(volume_mm3, 9e6);  // a beam of 70 x 80 x 1630 mm alone
  const ModelFace& face = model->faces[*FindFace(*model, "left_cylinder")];
  for (std::uint32_t i = face.first_triangle; i < face.first_triangle + face.triangle_count; ++i) {
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();
    for (const auto v : model->triangles[i]) middle += model->vertices[v] / 3;
    EXPECT_NEAR(std::hypot(middle.y(), middle.z()), 44.85, 0.0055);  // mm, chord error and single precision
  }
}

// The axle's STEP file, damaged and then read.
Result<ModelBundle> ReadDamaged(const std::function<void(std::string&)>& damage) {
  const auto path =
      std::filesystem::temp_directory_path() / fmt::format("forgescan_damaged_{}.step", ::getpid());
  RETURN_IF_ERROR(testing::WriteAxleStep({}, path));
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  std::string bytes = text.str();
  damage(bytes);
  std::ofstream(path, std::ios::trunc) << bytes;
  auto model = LoadModel(path, {});
  std::filesystem::remove(path);
  return model;
}

std::string WhyRefused(const std::function<void(std::string&)>& damage) {
  const auto model = ReadDamaged(damage);
  return model.ok() ? "not refused" : model.error().message;
}

// The entity of this type that comes first, "#12 = TYPE(...);".
std::pair<std::size_t, std::size_t> FirstEntity(const std::string& bytes, const std::string& type) {
  const std::size_t begin = bytes.rfind('\n', bytes.find(type + "(")) + 1;
  return {begin, bytes.find(";", begin) + 1 - begin};
}

TEST(ModelTest, RefusesAStepFileOfWhichAPartIsMissing) {
  ASSERT_TRUE(ReadDamaged([](std::string&) {}).ok());
  const std::string without_face = WhyRefused([](std::string& bytes) {
    const auto [begin, length] = FirstEntity(bytes, "ADVANCED_FACE");
    bytes.erase(begin, length);
  });
  EXPECT_NE(without_face.find("cannot be read"), std::string::npos) << without_face;
  const std::string negative_radius = WhyRefused([](std::string& bytes) {
    const auto [begin, length] = FirstEntity(bytes, "CYLINDRICAL_SURFACE");
    const std::size_t comma = bytes.rfind(',', begin + length);
    bytes.replace(comma, begin + length - comma, ",-1.);");
  });
  EXPECT_EQ(negative_radius.find("not refused"), std::string::npos);
  EXPECT_NE(negative_radius.find("STEP file"), std::string::npos) << negative_radius;
}

TEST(ModelTest, RefusesAnOpenShell) {
  const std::string open = WhyRefused([](std::string& bytes) {
    const auto [begin, length] = FirstEntity(bytes, "CLOSED_SHELL");
    const std::size_t list = bytes.find("(#", begin);  // the first of its faces goes
    bytes.erase(list + 1, bytes.find('#', list + 2) - list - 1);
  });
  EXPECT_NE(open.find("face"), std::string::npos) << open;
  EXPECT_EQ(open.find("not refused"), std::string::npos);
}

TEST(ModelTest, RefusesAPartOfAnImpossibleSize) {
  for (const char* unit : {"$", ".MEGA."}) {
    const std::string why = WhyRefused([unit](std::string& bytes) {
      const std::size_t at = bytes.find("SI_UNIT(.MILLI.,.METRE.)");
      bytes.replace(at + 8, 7, unit);
    });
    EXPECT_NE(why.find("unit is wrong"), std::string::npos) << why;
  }
}

TEST(ModelTest, SaysWhatIsWrongWithAModelFile) {
  const auto folder = std::filesystem::temp_directory_path();
  EXPECT_EQ(LoadModel(folder / "there_is_no_such.step", {}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(LoadModel(folder / "there_is_no_such.stl", {}).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(LoadModel("model.obj", {}).error().code, ErrorCode::kInvalidArgument);
  const auto path = folder / fmt::format("forgescan_not_a_step_{}.step", ::getpid());
  std::ofstream(path) << "this is not a STEP file";
  EXPECT_EQ(LoadModel(path, {}).error().code, ErrorCode::kFormat);
  std::filesystem::remove(path);
  EXPECT_EQ(ModelFromMesh(BoxMesh(), 0).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(ModelFromMesh(BoxMesh(), 1e-4).error().code, ErrorCode::kInvalidArgument);
  TriangleMesh flat = BoxMesh();
  for (auto& v : flat.vertices) v.setZero();
  EXPECT_EQ(ModelFromMesh(flat, 1).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan
