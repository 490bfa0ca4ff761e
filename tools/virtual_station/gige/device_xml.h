// The camera's description of itself for GenICam clients: which features it has and which registers hold
// them.
#pragma once

#include <cstdint>
#include <string>

namespace forgescan::gige {

struct DeviceIdentity;

// Source: GenICam schema 1.1, Standard Features Naming Convention. Length is a multiple of 4 (padded with
// line ends), so that it can be read in whole words.
std::string MakeDeviceXml(const DeviceIdentity& identity, std::uint32_t sensor_width_px,
                          std::uint32_t sensor_height_px);

}  // namespace forgescan::gige
