// GVSP, the stream protocol of GigE Vision: one frame as leader, data packets and trailer, built without
// copying pixels.
//
// Source: GigE Vision 1.2, stream protocol. Packet header, 8 bytes: status, block id, format (1 byte), packet
// id (3 bytes). Packet 0 is the leader, 1..n carry the payload, n + 1 is the trailer. Payload = image, then
// chunks if there are any.
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace forgescan::gige {

inline constexpr std::uint32_t kMono8 = 0x01080001;
inline constexpr std::uint32_t kIpUdpHeader_bytes = 28;
inline constexpr std::uint32_t kGvspHeader_bytes = 8;
inline constexpr std::uint32_t kEthernet_bytes =
    38;  // preamble, header, checksum and gap around an IP packet

enum class PacketStatus : std::uint16_t { kSuccess = 0x0000, kResent = 0x0100, kUnavailable = 0x800c };

// Immutable once handed to the transmitter.
struct GvspFrame {
  std::uint16_t block_id = 0;
  std::uint64_t timestamp_ns = 0;
  std::int64_t ready_ns =
      0;  // end of exposure, CLOCK_MONOTONIC: the first packet leaves then if the port is free
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> image;
  std::vector<std::uint8_t> chunks;     // everything behind the pixels; empty: plain image payload
  std::uint32_t packet_size_bytes = 0;  // IP packet
  std::int64_t packet_delay_ns = 0;
  sockaddr_in target{};

  std::uint32_t data_packets() const;
  std::uint32_t packets() const { return data_packets() + 2; }
  // Of all its packets.
  std::size_t wire_bytes() const;
};

// Ids and times that follow the pixels; a chunk is its data, its id and its length.
struct ChunkSelection {
  bool active = false;
  bool frame_id = false;
  bool timestamp = false;
  bool exposure_time = false;
};
struct ChunkValues {
  std::uint32_t image_bytes = 0;
  std::uint64_t frame_id = 0;
  std::uint64_t timestamp_ns = 0;
  std::uint64_t exposure_us = 0;
};
inline constexpr std::uint32_t kImageChunkId = 0x1000;
inline constexpr std::uint32_t kFrameIdChunkId = 0x1001;
inline constexpr std::uint32_t kTimestampChunkId = 0x1002;
inline constexpr std::uint32_t kExposureChunkId = 0x1003;
std::vector<std::uint8_t> MakeChunks(const ChunkSelection& selection, const ChunkValues& values);

// A packet ready for a gathering send: own head bytes, then up to two pieces of the frame. Valid while the
// frame lives.
struct GvspPacket {
  std::array<std::uint8_t, 44> head{};
  std::size_t head_bytes = 0;
  std::span<const std::uint8_t> image_part;
  std::span<const std::uint8_t> chunk_part;

  std::size_t udp_bytes() const { return head_bytes + image_part.size() + chunk_part.size(); }
  std::size_t wire_bytes() const { return udp_bytes() + kIpUdpHeader_bytes + kEthernet_bytes; }
};

// packet_id < frame.packets().
GvspPacket MakePacket(const GvspFrame& frame, std::uint32_t packet_id, PacketStatus status);
// The answer to a resend request that cannot be met: a header only.
GvspPacket MakeUnavailable(std::uint16_t block_id, std::uint32_t packet_id);

}  // namespace forgescan::gige
