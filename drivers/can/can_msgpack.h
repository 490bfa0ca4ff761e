// The datagram of python-can's udp_multicast interface: one MessagePack map per frame. Only what that format
// needs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/can/can_bus.h"

namespace forgescan {

// Source: python-can 4.1.0, interface "udp_multicast" (keys timestamp, arbitration_id, is_extended_id,
// is_remote_frame, is_error_frame, channel, dlc, data, is_fd, bitrate_switch, error_state_indicator),
// MessagePack specification. `timestamp_us` is written as seconds; readers take the time of arrival instead.
std::vector<std::uint8_t> EncodeCanDatagram(const CanFrame& frame, std::int64_t timestamp_us);

// Reads any MessagePack map with those keys, in any order; unknown keys are skipped. utime of the result is
// 0. Errors: kFormat when the bytes are not such a map, are cut short, nest deeper than 4, or hold a CAN FD
// frame, an identifier or a length out of range. Cost: bounded by the size of the datagram.
Result<CanFrame> DecodeCanDatagram(std::span<const std::uint8_t> bytes);

}  // namespace forgescan
