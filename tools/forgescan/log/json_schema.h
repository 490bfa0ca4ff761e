// Schemas and messages in JSON as viewers know them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "services/common/geometry/point_cloud.h"
#include "services/common/log/lcm_type.h"

namespace forgescan {

// JSON schema of what JsonText(DecodeToJson(message)) gives for the type. type: of `types`. A type within
// itself is any object.
nlohmann::ordered_json SchemaOf(const LcmTypes& types, const LcmStruct& type);
// Of UnknownToJson().
nlohmann::ordered_json UnknownSchema();

// Foxglove's well-known messages. utime: us since 1970, earlier times are 1970.
nlohmann::ordered_json ImageSchema();
nlohmann::ordered_json ImageMessage(std::int64_t utime, const std::string& frame_id, const std::string& png);
nlohmann::ordered_json CloudSchema();
// Coordinates in m, sigma in mm, and the view of each point.
nlohmann::ordered_json CloudMessage(std::int64_t utime, const std::string& frame_id, const PointCloud& cloud);

}  // namespace forgescan
