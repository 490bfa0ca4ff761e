// The part of CANopen that the station speaks: identifiers, network management, heartbeat, emergency,
// expedited SDO.
//
// Source: the pre-defined connection set of CiA 301. Pure: frames in, frames out, no bus and no clock.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/can/can_bus.h"

namespace forgescan::canopen {

inline constexpr std::uint32_t kNmtId = 0x000;
inline constexpr std::uint32_t kEmergencyBase = 0x080;
inline constexpr std::uint32_t kSdoAnswerBase = 0x580;
inline constexpr std::uint32_t kSdoRequestBase = 0x600;
inline constexpr std::uint32_t kHeartbeatBase = 0x700;

enum class NmtCommand : std::uint8_t {
  kStart = 1,
  kStop = 2,
  kPreOperational = 128,
  kResetNode = 129,
  kResetCommunication = 130
};
enum class NmtState : std::uint8_t { kBoot = 0, kStopped = 4, kOperational = 5, kPreOperational = 127 };

// Heartbeat times of the whole station.
inline constexpr std::int64_t kHeartbeatPeriod_us = 100'000;
inline constexpr std::int64_t kHeartbeatTimeout_us = 350'000;

// Error codes used here.
inline constexpr std::uint16_t kNoError = 0x0000;
inline constexpr std::uint16_t kDeviceTemperature = 0x4200;
inline constexpr std::uint16_t kHardware = 0x5000;
inline constexpr std::uint16_t kRpdoTimeout = 0x8250;
inline constexpr std::uint16_t kDeviceSpecific = 0xFF00;
inline constexpr std::uint16_t kViewRefused = 0xFF01;  // view out of the order of the path

struct Emergency {
  std::uint16_t code = kNoError;
  std::uint8_t error_register = 0;
  std::uint32_t detail = 0;  // little endian in bytes 3..6; byte 7 is not used
};

CanFrame NmtFrame(NmtCommand command, std::uint8_t node);
CanFrame HeartbeatFrame(std::uint8_t node, NmtState state);
CanFrame EmergencyFrame(std::uint8_t node, const Emergency& emergency);

// Nothing when the frame is not that frame of that node, or breaks its format.
std::optional<NmtCommand> ParseNmt(const CanFrame& frame,
                                   std::uint8_t node);  // node 0 in the frame addresses all
std::optional<NmtState> ParseHeartbeat(const CanFrame& frame, std::uint8_t node);
std::optional<Emergency> ParseEmergency(const CanFrame& frame, std::uint8_t node);

struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  auto operator<=>(const ObjectAddress&) const = default;
};

struct ObjectEntry {
  std::uint32_t value = 0;
  std::uint8_t bytes = 4;  // 1..4
  bool writable = false;
};

inline constexpr std::uint32_t kAbortUnknownCommand = 0x05040001;
inline constexpr std::uint32_t kAbortReadOnly = 0x06010002;
inline constexpr std::uint32_t kAbortNoObject = 0x06020000;
inline constexpr std::uint32_t kAbortWrongLength = 0x06070010;

// One expedited transfer: a value of 1..4 bytes.
struct SdoMessage {
  enum class Kind { kRead, kReadAnswer, kWrite, kWriteAnswer, kAbort } kind = Kind::kRead;
  ObjectAddress object;
  std::uint32_t value = 0;  // of kReadAnswer and kWrite; the code of kAbort
  std::uint8_t bytes = 4;   // 1..4, of kReadAnswer and kWrite
};

// `id` is kSdoRequestBase or kSdoAnswerBase plus the node.
CanFrame SdoFrame(std::uint32_t id, const SdoMessage& message);
std::optional<SdoMessage> ParseSdoRequest(const CanFrame& frame, std::uint8_t node);
std::optional<SdoMessage> ParseSdoAnswer(const CanFrame& frame, std::uint8_t node);

}  // namespace forgescan::canopen
