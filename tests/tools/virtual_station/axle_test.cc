#include "tools/virtual_station/axle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

namespace forgescan {
namespace {

std::string TemporaryFile(const std::string& name) { return testing::TempDir() + "/" + name; }

TEST(Axle, MeshHasTheFiveDimensions) {
  const AxleSize size{1889.1, 178.2, 177.9, 89.1, 88.9};
  const auto mesh = BuildAxleMesh(size);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  double low_x = 0, high_x = 0, left_plate = 0, right_plate = 0;
  for (const auto& v : mesh->vertices) {
    low_x = std::min(low_x, v.x());
    high_x = std::max(high_x, v.x());
    (v.x() < 0 ? left_plate : right_plate) = std::max(v.x() < 0 ? left_plate : right_plate, std::abs(v.y()));
  }
  // Planes are exact: rounding of double at 1 m.
  EXPECT_NEAR(high_x - low_x, size.total_length_mm, 1e-9);
  EXPECT_NEAR(2 * left_plate, size.left_plate_width_mm, 1e-9);
  EXPECT_NEAR(2 * right_plate, size.right_plate_width_mm, 1e-9);
}

TEST(Axle, CylinderFacetsStayWithinTheChordError) {
  const AxleSize size;
  const auto mesh = BuildAxleMesh(size);
  ASSERT_TRUE(mesh.ok());
  int facets = 0;
  for (const auto& t : mesh->triangles) {
    const Eigen::Vector3d centre =
        (mesh->vertices[static_cast<std::size_t>(t[0])] + mesh->vertices[static_cast<std::size_t>(t[1])] +
         mesh->vertices[static_cast<std::size_t>(t[2])]) /
        3.0;
    const double radius = std::hypot(centre.y(), centre.z());
    if (centre.x() > -940.0 && centre.x() < -815.0 && radius > 40.0) {
      ++facets;
      EXPECT_LE(radius, 0.5 * size.left_cylinder_diameter_mm + 1e-9);
      EXPECT_GE(radius, 0.5 * size.left_cylinder_diameter_mm - 0.003);  // mm: the bound of the mesher
    }
  }
  EXPECT_GT(facets, 200);
}

TEST(Axle, StepFileNamesTheEightFaces) {
  const std::string path = TemporaryFile("axle_test.step");
  const Status written = WriteAxleStep({}, path);
  ASSERT_TRUE(written.ok()) << written.error().message;
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  for (const std::string& name : AxleFaceNames()) {
    const std::string face = "ADVANCED_FACE('" + name + "'";
    const std::size_t first = text.str().find(face);
    EXPECT_NE(first, std::string::npos) << name;
    EXPECT_EQ(text.str().find(face, first + 1), std::string::npos) << name << " is there twice";
  }
  EXPECT_NE(text.str().find("CYLINDRICAL_SURFACE('',#"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(Axle, RefusesWrongSizesAndPlaces) {
  AxleSize size;
  size.left_plate_width_mm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(BuildAxleMesh(size).ok());
  size.left_plate_width_mm = 20.0;
  const auto mesh = BuildAxleMesh(size);
  ASSERT_FALSE(mesh.ok());
  EXPECT_NE(mesh.error().message.find("left_plate_width is 20 mm, allowed"), std::string::npos);
  EXPECT_FALSE(WriteAxleStl({}, "/nowhere/axle.stl").ok());
}

}  // namespace
}  // namespace forgescan
