// The file of dimensions: what it may say, and which faces of the model it may name.
#include "services/common/model/features.h"

#include <gtest/gtest.h>

#include "tests/common/shapes/test_axle.h"

namespace forgescan {
namespace {

constexpr const char* kWidth =
    "[[dimension]]\nname='w'\ntype='width'\nfaces=['left_plate_front','left_plate_back']\nlower_mm=1\nupper_"
    "mm=2\n";
constexpr const char* kPart = "part='axle'\nreference_temperature_degc=900.0\n";

TEST(FeaturesTest, RefusesWithFileDimensionAndKey) {
  ASSERT_TRUE(ParseFeatures(std::string(kPart) + kWidth, "f").ok());
  const std::pair<std::string, std::string> wrong[] = {
      {std::string(kWidth), "part"},
      {std::string(kPart), "dimension"},
      {std::string(kPart) + kWidth + "extra=1\n", "extra"},
      {std::string(kPart) + kWidth + "datum=['left_cylinder']\n", "datum"},
      {std::string(kPart) + kWidth + kWidth, "'w'"},
      {std::string(kPart) + kWidth + "expanded_uncertainty_mm=-1\n", "expanded_uncertainty_mm"},
      {std::string(kPart) + "[[dimension]]\nname='a'\ntype='height'\n", "height"},
      {std::string(kPart) +
           "[[dimension]]\nname='a'\ntype='width'\nfaces=['x','y']\nlower_mm=2\nupper_mm=1\n",
       "limits"},
      {std::string(kPart) +
           "[[dimension]]\nname='a'\ntype='width'\nfaces=['x','y']\nlower_mm=nan\nupper_mm=1\n",
       "lower_mm"},
      {"part=", "line"}};
  for (const auto& [text, word] : wrong) {
    const auto features = ParseFeatures(text, "axle.toml");
    ASSERT_FALSE(features.ok()) << text;
    EXPECT_NE(features.error().message.find(word), std::string::npos) << features.error().message;
    EXPECT_EQ(features.error().message.rfind("axle.toml", 0), 0U) << features.error().message;
  }
}

TEST(FeaturesTest, BindingChecksTheFaces) {
  const auto model = testing::MakeAxle({}, 5);
  ASSERT_TRUE(model.ok());
  const auto bind = [&](const std::string& type, const std::string& faces) {
    const auto features = ParseFeatures(
        fmt::format("{}[[dimension]]\nname='d'\ntype='{}'\nfaces=[{}]\nlower_mm=1\nupper_mm=2\n", kPart, type,
                    faces),
        "f");
    return BindFeatures(*features, *model);
  };
  EXPECT_NEAR(bind("width", "'right_plate_front','right_plate_back'")->dimensions[0].nominal_mm, 177.4, 1e-6);
  EXPECT_EQ(bind("width", "'right_plate_front','nothing'").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(bind("width", "'right_plate_front','left_end_face'").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bind("diameter", "'left_end_face'").error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(bind("diameter", "'left_cylinder','right_cylinder'").error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace forgescan
