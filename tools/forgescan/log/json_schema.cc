#include "tools/forgescan/log/json_schema.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "services/common/base64.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

Json BytesSchema() { return {{"type", "string"}, {"contentEncoding", "base64"}}; }
Json TypeSchema(const char* type) { return {{"type", type}}; }

Json ObjectSchema(const std::string& title, Json properties) {
  return {{"title", title}, {"type", "object"}, {"properties", std::move(properties)}};
}

Json TimeSchema() {
  Json schema = ObjectSchema("time", {{"sec", TypeSchema("integer")}, {"nsec", TypeSchema("integer")}});
  return schema;
}

Json Time(std::int64_t utime) {
  const std::int64_t us = std::max<std::int64_t>(0, utime);
  return {{"sec", us / 1'000'000}, {"nsec", us % 1'000'000 * 1000}};
}

Json PrimitiveSchema(LcmPrimitive primitive) {
  switch (primitive) {
    case LcmPrimitive::kString:
      return TypeSchema("string");
    case LcmPrimitive::kBoolean:
      return TypeSchema("boolean");
    case LcmPrimitive::kFloat:
    case LcmPrimitive::kDouble:
      return TypeSchema("number");
    default:
      return TypeSchema("integer");
  }
}

Json StructSchema(const LcmTypes& types, const LcmStruct& type, std::vector<const LcmStruct*>& within);

Json FieldSchema(const LcmTypes& types, const LcmField& field, std::vector<const LcmStruct*>& within) {
  const bool is_bytes = field.primitive == LcmPrimitive::kByte && !field.dimensions.empty();
  Json schema = is_bytes          ? BytesSchema()
                : field.primitive ? PrimitiveSchema(*field.primitive)
                                  : StructSchema(types, *types.Find(field.type), within);
  for (std::size_t i = is_bytes ? 1 : 0; i < field.dimensions.size(); ++i) {
    schema = {{"type", "array"}, {"items", std::move(schema)}};
  }
  return schema;
}

Json StructSchema(const LcmTypes& types, const LcmStruct& type, std::vector<const LcmStruct*>& within) {
  Json properties = Json::object();
  if (std::find(within.begin(), within.end(), &type) == within.end()) {
    within.push_back(&type);
    for (const LcmField& field : type.fields) {
      properties[field.name] = FieldSchema(types, field, within);
    }
    within.pop_back();
  }
  return ObjectSchema(type.name, std::move(properties));
}

struct PackedField {
  const char* name;
  std::size_t offset_bytes;
  int type;  // foxglove's numbers: 3 = uint16, 7 = float32
};
constexpr std::array<PackedField, 8> kPointFields{{{"x", 0, 7},
                                                   {"y", 4, 7},
                                                   {"z", 8, 7},
                                                   {"nx", 12, 7},
                                                   {"ny", 16, 7},
                                                   {"nz", 20, 7},
                                                   {"sigma_mm", 24, 7},
                                                   {"view", 28, 3}}};
constexpr std::size_t kPointBytes = 30;
static_assert(std::endian::native == std::endian::little, "points are packed little-endian");

std::vector<std::uint8_t> PackPoints(const PointCloud& cloud) {
  constexpr float kMPerMm = 1e-3F;
  std::vector<std::uint8_t> bytes(cloud.size() * kPointBytes);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f p_m = cloud.points[i] * kMPerMm, &n = cloud.normals[i];
    const std::array<float, 7> values{p_m.x(), p_m.y(), p_m.z(), n.x(), n.y(), n.z(), cloud.sigma_mm[i]};
    std::memcpy(&bytes[i * kPointBytes], values.data(), sizeof values);
    std::memcpy(&bytes[i * kPointBytes + sizeof values], &cloud.view[i], sizeof cloud.view[i]);
  }
  return bytes;
}

}  // namespace

Json SchemaOf(const LcmTypes& types, const LcmStruct& type) {
  std::vector<const LcmStruct*> within;
  return StructSchema(types, type, within);
}

Json UnknownSchema() {
  return ObjectSchema("lcm.unknown", {{"fingerprint", TypeSchema("string")}, {"data", BytesSchema()}});
}

Json ImageSchema() {
  return ObjectSchema("foxglove.CompressedImage", {{"timestamp", TimeSchema()},
                                                   {"frame_id", TypeSchema("string")},
                                                   {"data", BytesSchema()},
                                                   {"format", TypeSchema("string")}});
}

Json ImageMessage(std::int64_t utime, const std::string& frame_id, const std::string& png) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(png.data());
  return {{"timestamp", Time(utime)},
          {"frame_id", frame_id},
          {"data", Base64({bytes, png.size()})},
          {"format", "png"}};
}

Json CloudSchema() {
  const Json number = TypeSchema("number");
  const Json position = ObjectSchema("foxglove.Vector3", {{"x", number}, {"y", number}, {"z", number}});
  const Json orientation =
      ObjectSchema("foxglove.Quaternion", {{"x", number}, {"y", number}, {"z", number}, {"w", number}});
  const Json field = ObjectSchema(
      "foxglove.PackedElementField",
      {{"name", TypeSchema("string")}, {"offset", TypeSchema("integer")}, {"type", TypeSchema("integer")}});
  return ObjectSchema(
      "foxglove.PointCloud",
      {{"timestamp", TimeSchema()},
       {"frame_id", TypeSchema("string")},
       {"pose", ObjectSchema("foxglove.Pose", {{"position", position}, {"orientation", orientation}})},
       {"point_stride", TypeSchema("integer")},
       {"fields", {{"type", "array"}, {"items", field}}},
       {"data", BytesSchema()}});
}

Json CloudMessage(std::int64_t utime, const std::string& frame_id, const PointCloud& cloud) {
  Json fields = Json::array();
  for (const PackedField& field : kPointFields) {
    fields.push_back({{"name", field.name}, {"offset", field.offset_bytes}, {"type", field.type}});
  }
  return {{"timestamp", Time(utime)},
          {"frame_id", frame_id},
          {"pose",
           {{"position", {{"x", 0}, {"y", 0}, {"z", 0}}},
            {"orientation", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}}},
          {"point_stride", kPointBytes},
          {"fields", std::move(fields)},
          {"data", Base64(PackPoints(cloud))}};
}

}  // namespace forgescan
