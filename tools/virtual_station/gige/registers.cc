#include "tools/virtual_station/gige/registers.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tools/virtual_station/gige/bytes.h"
#include "tools/virtual_station/gige/device_xml.h"

namespace forgescan::gige {
namespace {

constexpr std::uint32_t kTickFrequency_hz = 1'000'000'000;
constexpr std::uint32_t kDefaultHeartbeat_ms = 3000;
constexpr std::uint32_t kDefaultPacketSize_bytes = 1400;
constexpr std::uint32_t kMask16 = 0xffff;

enum class Lock { kNever, kWhileAcquiring };

// A register that a client may write, and what it may write there.
struct WriteRule {
  std::uint32_t address, low, high, step;
  Lock lock;
};

constexpr std::uint32_t kAny = 0xffffffff;
constexpr std::array kWriteRules = {
    WriteRule{reg::kHeartbeatTimeout, 500, 60'000, 1, Lock::kNever},
    WriteRule{reg::kControlPrivilege, 0, 3, 1, Lock::kNever},
    WriteRule{reg::kStreamPort, 0, kAny, 1, Lock::kNever},
    WriteRule{reg::kStreamPacketSize, 0, kAny, 1,
              Lock::kNever},  // its size field is checked in SetPacketSize
    WriteRule{reg::kStreamPacketDelay, 0, 1'000'000'000, 1, Lock::kNever},
    WriteRule{reg::kStreamAddress, 0, kAny, 1, Lock::kNever},
    WriteRule{reg::kWidth, 16, 65532, 4, Lock::kWhileAcquiring},  // and the sensor's size, in Write()
    WriteRule{reg::kHeight, 16, 65532, 4, Lock::kWhileAcquiring},
    WriteRule{reg::kOffsetX, 0, 65532, 4, Lock::kWhileAcquiring},
    WriteRule{reg::kOffsetY, 0, 65532, 4, Lock::kWhileAcquiring},
    WriteRule{reg::kPixelFormat, kMono8, kMono8, 1, Lock::kWhileAcquiring},
    WriteRule{reg::kAcquisitionMode, 0, 0, 1, Lock::kWhileAcquiring},
    WriteRule{reg::kAcquisition, 0, 1, 1, Lock::kNever},
    WriteRule{reg::kTriggerSelector, 0, 0, 1, Lock::kNever},
    WriteRule{reg::kTriggerMode, 0, 1, 1, Lock::kNever},
    WriteRule{reg::kTriggerSource, 0, 1, 1, Lock::kNever},
    WriteRule{reg::kTriggerActivation, 0, 0, 1, Lock::kNever},
    WriteRule{reg::kExposureUs, 10, 10'000'000, 1, Lock::kNever},
    WriteRule{reg::kChunkActive, 0, 1, 1, Lock::kWhileAcquiring},
    WriteRule{reg::kChunkSelector, 0, 2, 1, Lock::kNever},
    WriteRule{reg::kChunkEnable, 0, 1, 1, Lock::kWhileAcquiring},
    WriteRule{reg::kChunkEnable + 4, 0, 1, 1, Lock::kWhileAcquiring},
    WriteRule{reg::kChunkEnable + 8, 0, 1, 1, Lock::kWhileAcquiring},
};

bool PacketSizeAllowed(std::uint32_t value) {
  const std::uint32_t size_bytes = value & kMask16;
  return size_bytes >= 576 && size_bytes <= 16380 && size_bytes % 4 == 0;
}

}  // namespace

RegisterFile::RegisterFile(DeviceIdentity identity, std::uint32_t sensor_width_px,
                           std::uint32_t sensor_height_px, bool offers_resend)
    : identity_(std::move(identity)),
      sensor_width_px_(sensor_width_px),
      sensor_height_px_(sensor_height_px),
      offers_resend_(offers_resend),
      xml_(MakeDeviceXml(identity_, sensor_width_px, sensor_height_px)) {
  Reset();
}

void RegisterFile::Reset() {
  const std::lock_guard lock(mutex_);
  memory_.assign(reg::kXml + xml_.size(), 0);
  std::copy(xml_.begin(), xml_.end(), memory_.begin() + reg::kXml);
  Put(reg::kVersion, 0x00010002);
  Put(reg::kDeviceMode, 0x80000001);  // big-endian, UTF-8
  Put(reg::kMacHigh, static_cast<std::uint32_t>(identity_.mac >> 32));
  Put(reg::kMacLow, static_cast<std::uint32_t>(identity_.mac));
  Put(reg::kSupportedIpConfiguration, 0x4);  // link-local; the address is given by the simulator
  Put(reg::kCurrentIpConfiguration, 0x4);
  Put(reg::kIpAddress, identity_.address);
  Put(reg::kSubnetMask, 0xff000000);
  SetText(reg::kVendor, 32, identity_.vendor);
  SetText(reg::kModel, 32, identity_.model);
  SetText(reg::kDeviceVersion, 32, "1");
  SetText(reg::kVendorInfo, 48, "virtual station");
  SetText(reg::kSerial, 16, identity_.serial);
  SetText(reg::kUserName, 16, identity_.user_name);
  SetText(reg::kXmlUrl, 512, fmt::format("Local:camera.xml;{:x};{:x}", reg::kXml, xml_.size()));
  Put(reg::kInterfaceCount, 1);
  Put(reg::kStreamCount, 1);
  Put(reg::kGvcpCapability, kCapabilityWriteMemory | (offers_resend_ ? kCapabilityResend : 0U));
  Put(reg::kHeartbeatTimeout, kDefaultHeartbeat_ms);
  Put(reg::kTickFrequencyLow, kTickFrequency_hz);
  Put(reg::kStreamPacketSize, kDefaultPacketSize_bytes);
  Put(reg::kWidth, sensor_width_px_);
  Put(reg::kHeight, sensor_height_px_);
  Put(reg::kPixelFormat, kMono8);
  Put(reg::kExposureUs, 5000);
  Put(reg::kSensorWidth, sensor_width_px_);
  Put(reg::kSensorHeight, sensor_height_px_);
  UpdatePayloadSize();
}

std::uint32_t RegisterFile::Get(std::uint32_t address) const {
  const std::lock_guard lock(mutex_);
  return At(address);
}

void RegisterFile::Set(std::uint32_t address, std::uint32_t value) {
  const std::lock_guard lock(mutex_);
  Put(address, value);
}

std::optional<std::vector<std::uint8_t>> RegisterFile::Read(std::uint32_t address,
                                                            std::uint32_t size_bytes) const {
  const std::lock_guard lock(mutex_);
  if (static_cast<std::uint64_t>(address) + size_bytes > memory_.size()) {
    return std::nullopt;
  }
  const auto begin = memory_.begin() + address;
  return std::vector<std::uint8_t>(begin, begin + size_bytes);
}

GvcpStatus RegisterFile::Write(std::uint32_t address, std::uint32_t value) {
  const std::lock_guard lock(mutex_);
  const auto* rule = std::find_if(kWriteRules.begin(), kWriteRules.end(),
                                  [&](const WriteRule& candidate) { return candidate.address == address; });
  if (rule == kWriteRules.end()) {
    return address < memory_.size() ? GvcpStatus::kWriteProtect : GvcpStatus::kInvalidAddress;
  }
  if (rule->lock == Lock::kWhileAcquiring && At(reg::kAcquisition) != 0) {
    return GvcpStatus::kBusy;
  }
  bool allowed = value >= rule->low && value <= rule->high && (value - rule->low) % rule->step == 0;
  allowed = allowed && !(address == reg::kWidth && value + At(reg::kOffsetX) > sensor_width_px_);
  allowed = allowed && !(address == reg::kOffsetX && value + At(reg::kWidth) > sensor_width_px_);
  allowed = allowed && !(address == reg::kHeight && value + At(reg::kOffsetY) > sensor_height_px_);
  allowed = allowed && !(address == reg::kOffsetY && value + At(reg::kHeight) > sensor_height_px_);
  allowed = allowed && !(address == reg::kStreamPacketSize && !PacketSizeAllowed(value));
  if (!allowed) {
    return GvcpStatus::kInvalidParameter;
  }
  Put(address, address == reg::kStreamPacketSize ? value & ~kFireTestPacket : value);
  UpdatePayloadSize();
  return GvcpStatus::kSuccess;
}

AcquisitionSettings RegisterFile::settings() const {
  const std::lock_guard lock(mutex_);
  AcquisitionSettings settings;
  settings.acquiring = At(reg::kAcquisition) != 0;
  settings.line_triggered = At(reg::kTriggerMode) == 1 && At(reg::kTriggerSource) == 0;
  settings.width_px = At(reg::kWidth);
  settings.height_px = At(reg::kHeight);
  settings.offset_x_px = At(reg::kOffsetX);
  settings.offset_y_px = At(reg::kOffsetY);
  settings.exposure_us = At(reg::kExposureUs);
  settings.chunks = Chunks();
  settings.packet_size_bytes = At(reg::kStreamPacketSize) & kMask16;
  settings.packet_delay_ns = At(reg::kStreamPacketDelay);  // ticks of 1 ns
  settings.target.sin_family = AF_INET;
  settings.target.sin_addr.s_addr = htonl(At(reg::kStreamAddress));
  settings.target.sin_port = htons(static_cast<std::uint16_t>(At(reg::kStreamPort) & kMask16));
  return settings;
}

void RegisterFile::SetText(std::uint32_t address, std::size_t size_bytes, const std::string& text) {
  std::copy_n(text.begin(), std::min(text.size(), size_bytes - 1), memory_.begin() + address);
}

void RegisterFile::Put(std::uint32_t address, std::uint32_t value) { Put32(memory_, address, value); }

std::uint32_t RegisterFile::At(std::uint32_t address) const { return Get32(memory_, address); }

ChunkSelection RegisterFile::Chunks() const {
  return {At(reg::kChunkActive) != 0, At(reg::kChunkEnable) != 0, At(reg::kChunkEnable + 4) != 0,
          At(reg::kChunkEnable + 8) != 0};
}

void RegisterFile::UpdatePayloadSize() {
  const std::size_t chunk_bytes = MakeChunks(Chunks(), {}).size();
  Put(reg::kPayloadSize, At(reg::kWidth) * At(reg::kHeight) + static_cast<std::uint32_t>(chunk_bytes));
}

}  // namespace forgescan::gige
