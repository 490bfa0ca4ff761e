#include "tools/virtual_station/gige/device_xml.h"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>
#include <utility>

#include "tools/virtual_station/gige/registers.h"

namespace forgescan::gige {
namespace {

struct Range {
  std::uint32_t low, high, step;
};

std::string Category(std::string_view name, std::initializer_list<std::string_view> features) {
  std::string text = fmt::format("<Category Name=\"{}\">", name);
  for (const std::string_view feature : features) {
    text += fmt::format("<pFeature>{}</pFeature>", feature);
  }
  return text + "</Category>\n";
}

// A 4-byte register of the device; `extra` for an address that depends on a selector.
std::string Register(std::string_view name, std::uint32_t address, std::string_view access,
                     std::string_view extra = "") {
  return fmt::format(
      "<IntReg Name=\"{}\"><Address>0x{:x}</Address>{}<Length>4</Length><AccessMode>{}</AccessMode>"
      "<pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</"
      "Endianess></IntReg>\n",
      name, address, extra, access);
}

// Part of a register. Bits are counted from the most significant one, 0..31, as big-endian registers are.
std::string BitField(std::string_view name, std::uint32_t address, int first_bit, int last_bit) {
  return fmt::format(
      "<MaskedIntReg Name=\"{}\"><Address>0x{:x}</Address><Length>4</Length><AccessMode>RW</AccessMode>"
      "<pPort>Device</pPort><Cachable>NoCache</Cachable><LSB>{}</LSB><MSB>{}</MSB><Sign>Unsigned</Sign>"
      "<Endianess>BigEndian</Endianess></MaskedIntReg>\n",
      name, address, last_bit, first_bit);
}

std::string Integer(std::string_view name, Range range) {
  return fmt::format(
      "<Integer Name=\"{0}\"><pValue>{0}Reg</pValue><Min>{1}</Min><Max>{2}</Max><Inc>{3}</Inc></Integer>\n",
      name, range.low, range.high, range.step);
}

std::string IntegerFeature(std::string_view name, std::uint32_t address, Range range) {
  return Integer(name, range) + Register(fmt::format("{}Reg", name), address, "RW");
}

std::string ConstantFeature(std::string_view name, std::uint32_t address) {
  return fmt::format("<Integer Name=\"{0}\"><pValue>{0}Reg</pValue></Integer>\n", name) +
         Register(fmt::format("{}Reg", name), address, "RO");
}

std::string Enumeration(std::string_view name, std::uint32_t address,
                        std::initializer_list<std::pair<std::string_view, std::uint32_t>> entries) {
  std::string text = fmt::format("<Enumeration Name=\"{}\">", name);
  for (const auto& [entry, value] : entries) {
    text += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry, value);
  }
  text += fmt::format("<pValue>{}Reg</pValue></Enumeration>\n", name);
  return text + Register(fmt::format("{}Reg", name), address, "RW");
}

std::string Command(std::string_view name, std::string_view reg_name, std::uint32_t value) {
  return fmt::format("<Command Name=\"{}\"><pValue>{}</pValue><CommandValue>{}</CommandValue></Command>\n",
                     name, reg_name, value);
}

std::string Text(std::string_view name, std::uint32_t address, int size_bytes) {
  return fmt::format(
      "<StringReg Name=\"{}\"><Address>0x{:x}</Address><Length>{}</Length><AccessMode>RO</AccessMode>"
      "<pPort>Device</pPort></StringReg>\n",
      name, address, size_bytes);
}

// A chunk: its own port, a register in it, and the feature that shows it ("Integer" or "Float").
std::string Chunk(std::string_view name, std::uint32_t id, std::string_view type) {
  return fmt::format(
      "<{2} Name=\"Chunk{0}\"><pValue>Chunk{0}Reg</pValue></{2}>\n"
      "<IntReg Name=\"Chunk{0}Reg\"><Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode>"
      "<pPort>{0}Port</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</"
      "Endianess></IntReg>\n"
      "<Port Name=\"{0}Port\"><ChunkID>{1:x}</ChunkID></Port>\n",
      name, id, type);
}

std::string Categories() {
  return Category("Root", {"DeviceControl", "ImageFormatControl", "AcquisitionControl", "ChunkDataControl",
                           "TransportLayerControl"}) +
         Category("DeviceControl", {"DeviceVendorName", "DeviceModelName", "DeviceVersion", "DeviceID"}) +
         Category("ImageFormatControl",
                  {"SensorWidth", "SensorHeight", "Width", "Height", "OffsetX", "OffsetY", "PixelFormat"}) +
         Category("AcquisitionControl",
                  {"AcquisitionMode", "AcquisitionStart", "AcquisitionStop", "TriggerSelector", "TriggerMode",
                   "TriggerSource", "TriggerActivation", "ExposureTime"}) +
         Category("ChunkDataControl", {"ChunkModeActive", "ChunkSelector", "ChunkEnable", "ChunkFrameID",
                                       "ChunkTimestamp", "ChunkExposureTime"}) +
         Category("TransportLayerControl", {"PayloadSize", "GevSCPSPacketSize", "GevSCPSFireTestPacket",
                                            "GevSCPD", "GevTimestampTickFrequency"});
}

std::string ImageFormat(std::uint32_t sensor_width_px, std::uint32_t sensor_height_px) {
  return ConstantFeature("SensorWidth", reg::kSensorWidth) +
         ConstantFeature("SensorHeight", reg::kSensorHeight) +
         IntegerFeature("Width", reg::kWidth, {16, sensor_width_px, 4}) +
         IntegerFeature("Height", reg::kHeight, {16, sensor_height_px, 4}) +
         IntegerFeature("OffsetX", reg::kOffsetX, {0, sensor_width_px - 16, 4}) +
         IntegerFeature("OffsetY", reg::kOffsetY, {0, sensor_height_px - 16, 4}) +
         Enumeration("PixelFormat", reg::kPixelFormat, {{"Mono8", kMono8}});
}

std::string Acquisition() {
  return Enumeration("AcquisitionMode", reg::kAcquisitionMode, {{"Continuous", 0}}) +
         Register("AcquisitionReg", reg::kAcquisition, "RW") +
         Command("AcquisitionStart", "AcquisitionReg", 1) + Command("AcquisitionStop", "AcquisitionReg", 0) +
         Enumeration("TriggerSelector", reg::kTriggerSelector, {{"FrameStart", 0}}) +
         Enumeration("TriggerMode", reg::kTriggerMode, {{"Off", 0}, {"On", 1}}) +
         Enumeration("TriggerSource", reg::kTriggerSource, {{"Line0", 0}, {"Line1", 1}}) +
         Enumeration("TriggerActivation", reg::kTriggerActivation, {{"RisingEdge", 0}}) +
         "<Float Name=\"ExposureTime\"><pValue>ExposureTimeReg</pValue><Min>10</Min><Max>10000000</Max>"
         "<Unit>us</Unit></Float>\n" +
         Register("ExposureTimeReg", reg::kExposureUs, "RW");
}

std::string Chunks() {
  return "<Boolean Name=\"ChunkModeActive\"><pValue>ChunkModeActiveReg</pValue></Boolean>\n" +
         Register("ChunkModeActiveReg", reg::kChunkActive, "RW") +
         Enumeration("ChunkSelector", reg::kChunkSelector,
                     {{"FrameID", 0}, {"Timestamp", 1}, {"ExposureTime", 2}}) +
         "<Boolean Name=\"ChunkEnable\"><pValue>ChunkEnableReg</pValue></Boolean>\n"
         "<IntSwissKnife Name=\"ChunkEnableOffset\"><pVariable Name=\"SEL\">ChunkSelectorReg</pVariable>"
         "<Formula>SEL * 4</Formula></IntSwissKnife>\n" +
         Register("ChunkEnableReg", reg::kChunkEnable, "RW", "<pAddress>ChunkEnableOffset</pAddress>") +
         Chunk("FrameID", kFrameIdChunkId, "Integer") + Chunk("Timestamp", kTimestampChunkId, "Integer") +
         Chunk("ExposureTime", kExposureChunkId, "Float");
}

std::string Transport() {
  return ConstantFeature("PayloadSize", reg::kPayloadSize) + Integer("GevSCPSPacketSize", {576, 16380, 4}) +
         BitField("GevSCPSPacketSizeReg", reg::kStreamPacketSize, 16, 31) +
         Command("GevSCPSFireTestPacket", "FireTestPacketReg", 1) +
         BitField("FireTestPacketReg", reg::kStreamPacketSize, 0, 0) +
         IntegerFeature("GevSCPD", reg::kStreamPacketDelay, {0, 1'000'000'000, 1}) +
         ConstantFeature("GevTimestampTickFrequency", reg::kTickFrequencyLow) +
         "<Integer Name=\"TLParamsLocked\"><Value>0</Value><Min>0</Min><Max>1</Max></Integer>\n"
         "<Port Name=\"Device\"></Port>\n";
}

}  // namespace

std::string MakeDeviceXml(const DeviceIdentity& identity, std::uint32_t sensor_width_px,
                          std::uint32_t sensor_height_px) {
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
      "<RegisterDescription ModelName=\"{}\" VendorName=\"{}\" ToolTip=\"virtual camera\" "
      "StandardNameSpace=\"GEV\" "
      "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" "
      "MinorVersion=\"0\" SubMinorVersion=\"0\" ProductGuid=\"2f0c9f34-3c37-4f0b-9d1f-6f64c2a0f001\" "
      "VersionGuid=\"2f0c9f34-3c37-4f0b-9d1f-6f64c2a0f002\" "
      "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n",
      identity.model, identity.vendor);
  xml += Categories();
  xml += Text("DeviceVendorName", reg::kVendor, 32) + Text("DeviceModelName", reg::kModel, 32) +
         Text("DeviceVersion", reg::kDeviceVersion, 32) + Text("DeviceID", reg::kSerial, 16);
  xml += ImageFormat(sensor_width_px, sensor_height_px) + Acquisition() + Chunks() + Transport();
  xml += "</RegisterDescription>\n";
  xml.resize((xml.size() + 3) / 4 * 4, '\n');
  return xml;
}

}  // namespace forgescan::gige
