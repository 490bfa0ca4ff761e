// The register file of a GigE Vision camera: bootstrap registers, the camera's own, and the description that
// names them.
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tools/virtual_station/gige/gvcp.h"
#include "tools/virtual_station/gige/gvsp.h"

namespace forgescan::gige {

// Addresses. Source: GigE Vision 1.2, bootstrap registers; from 0xa000 the camera maker's own choice.
namespace reg {
inline constexpr std::uint32_t kVersion = 0x0000, kDeviceMode = 0x0004, kMacHigh = 0x0008, kMacLow = 0x000c,
                               kSupportedIpConfiguration = 0x0010, kCurrentIpConfiguration = 0x0014,
                               kIpAddress = 0x0024, kSubnetMask = 0x0034, kVendor = 0x0048, kModel = 0x0068,
                               kDeviceVersion = 0x0088, kVendorInfo = 0x00a8, kSerial = 0x00d8,
                               kUserName = 0x00e8, kXmlUrl = 0x0200, kInterfaceCount = 0x0600,
                               kStreamCount = 0x0904, kGvcpCapability = 0x0934, kHeartbeatTimeout = 0x0938,
                               kTickFrequencyHigh = 0x093c, kTickFrequencyLow = 0x0940,
                               kControlPrivilege = 0x0a00, kStreamPort = 0x0d00, kStreamPacketSize = 0x0d04,
                               kStreamPacketDelay = 0x0d08, kStreamAddress = 0x0d18,
                               kStreamSourcePort = 0x0d1c;
inline constexpr std::uint32_t kWidth = 0xa000, kHeight = 0xa004, kOffsetX = 0xa008, kOffsetY = 0xa00c,
                               kPixelFormat = 0xa010, kAcquisitionMode = 0xa014, kAcquisition = 0xa018,
                               kTriggerSelector = 0xa01c, kTriggerMode = 0xa020, kTriggerSource = 0xa024,
                               kTriggerActivation = 0xa028, kExposureUs = 0xa02c, kChunkActive = 0xa030,
                               kChunkSelector = 0xa034, kPayloadSize = 0xa038, kSensorWidth = 0xa03c,
                               kSensorHeight = 0xa040,
                               kChunkEnable = 0xa050;  // + 4 * selector, three of them
inline constexpr std::uint32_t kXml = 0x10000;         // the description starts here
}  // namespace reg

inline constexpr std::uint32_t kDiscovery_bytes = 0xf8;  // the first registers are the discovery answer
inline constexpr std::uint32_t kFireTestPacket = 1U << 31;
inline constexpr std::uint32_t kCapabilityWriteMemory = 1U << 1;
inline constexpr std::uint32_t kCapabilityResend = 1U << 2;
inline constexpr std::uint32_t kPrivilegeMask = 0x3;  // exclusive or control

struct DeviceIdentity {
  std::string vendor, model, serial, user_name;
  std::uint64_t mac = 0;
  std::uint32_t address = 0;  // host byte order
};

// What a frame is made with; read in one piece.
struct AcquisitionSettings {
  bool acquiring = false;
  bool line_triggered = false;
  std::uint32_t width_px = 0, height_px = 0, offset_x_px = 0, offset_y_px = 0;
  std::int64_t exposure_us = 0;
  ChunkSelection chunks;
  std::uint32_t packet_size_bytes = 0;
  std::int64_t packet_delay_ns = 0;
  sockaddr_in target{};
};

// Thread-safe.
class RegisterFile {
 public:
  RegisterFile(DeviceIdentity identity, std::uint32_t sensor_width_px, std::uint32_t sensor_height_px,
               bool offers_resend);

  // As after power-on.
  void Reset();
  std::uint32_t Get(std::uint32_t address) const;
  // For the device itself: no access rule applies.
  void Set(std::uint32_t address, std::uint32_t value);

  // Memory of any length that lies wholly in the bootstrap, camera or description area; nullopt otherwise.
  std::optional<std::vector<std::uint8_t>> Read(std::uint32_t address, std::uint32_t size_bytes) const;
  // One register, under the access rules of a client.
  GvcpStatus Write(std::uint32_t address, std::uint32_t value);

  AcquisitionSettings settings() const;

 private:
  void SetText(std::uint32_t address, std::size_t size_bytes, const std::string& text);
  void Put(std::uint32_t address, std::uint32_t value);
  std::uint32_t At(std::uint32_t address) const;
  ChunkSelection Chunks() const;
  void UpdatePayloadSize();

  const DeviceIdentity identity_;
  const std::uint32_t sensor_width_px_, sensor_height_px_;
  const bool offers_resend_;
  const std::string xml_;
  mutable std::mutex mutex_;
  std::vector<std::uint8_t> memory_;
};

}  // namespace forgescan::gige
