#include "tools/virtual_station/gige/gvsp.h"

#include <algorithm>

#include "tools/virtual_station/gige/bytes.h"

namespace forgescan::gige {
namespace {

constexpr std::uint8_t kLeaderFormat = 1;
constexpr std::uint8_t kTrailerFormat = 2;
constexpr std::uint8_t kDataFormat = 3;
constexpr std::uint32_t kImagePayload = 0x0001;
constexpr std::uint32_t kWithChunks = 0x4000;
constexpr std::size_t kLeader_bytes = 36;

std::uint32_t DataBytesPerPacket(const GvspFrame& frame) {
  return frame.packet_size_bytes - kIpUdpHeader_bytes - kGvspHeader_bytes;
}

std::uint32_t PayloadType(const GvspFrame& frame) {
  return frame.chunks.empty() ? kImagePayload : kImagePayload | kWithChunks;
}

void PutHeader(GvspPacket& packet, std::uint16_t block_id, std::uint8_t format, std::uint32_t packet_id) {
  Put16(packet.head, 2, block_id);
  Put32(packet.head, 4, (static_cast<std::uint32_t>(format) << 24) | packet_id);
  packet.head_bytes = kGvspHeader_bytes;
}

void AddLeader(GvspPacket& packet, const GvspFrame& frame) {
  const auto leader = std::span(packet.head).subspan(kGvspHeader_bytes);
  Put16(leader, 2, PayloadType(frame));
  Put64(leader, 4, frame.timestamp_ns);
  Put32(leader, 12, kMono8);
  Put32(leader, 16, frame.width_px);
  Put32(leader, 20, frame.height_px);  // offsets and paddings stay 0
  packet.head_bytes = kGvspHeader_bytes + kLeader_bytes;
}

void AddTrailer(GvspPacket& packet, const GvspFrame& frame) {
  const auto trailer = std::span(packet.head).subspan(kGvspHeader_bytes);
  Put16(trailer, 2, PayloadType(frame));
  Put32(trailer, 4, frame.height_px);
  packet.head_bytes = kGvspHeader_bytes + 8;
  if (!frame.chunks.empty()) {
    Put32(trailer, 8, static_cast<std::uint32_t>(frame.image->size() + frame.chunks.size()));
    Put32(trailer, 12, 1);  // the layout of chunks never changes within a session
    packet.head_bytes += 8;
  }
}

void AddData(GvspPacket& packet, const GvspFrame& frame, std::uint32_t packet_id) {
  const std::size_t image_bytes = frame.image->size();
  const std::size_t total_bytes = image_bytes + frame.chunks.size();
  const std::size_t begin = static_cast<std::size_t>(packet_id - 1) * DataBytesPerPacket(frame);
  const std::size_t end = std::min(begin + DataBytesPerPacket(frame), total_bytes);
  if (begin < image_bytes) {
    packet.image_part = std::span(*frame.image).subspan(begin, std::min(end, image_bytes) - begin);
  }
  if (end > image_bytes) {
    const std::size_t chunk_begin = std::max(begin, image_bytes) - image_bytes;
    packet.chunk_part = std::span(frame.chunks).subspan(chunk_begin, end - image_bytes - chunk_begin);
  }
}

void AppendChunk(std::vector<std::uint8_t>& chunks, std::uint32_t id, std::uint64_t value) {
  Append64(chunks, value);
  Append32(chunks, id);
  Append32(chunks, 8);
}

}  // namespace

std::uint32_t GvspFrame::data_packets() const {
  const auto total_bytes = static_cast<std::uint32_t>(image->size() + chunks.size());
  return (total_bytes + DataBytesPerPacket(*this) - 1) / DataBytesPerPacket(*this);
}

std::size_t GvspFrame::wire_bytes() const {
  const std::uint32_t last = packets() - 1;
  const std::size_t leader = MakePacket(*this, 0, PacketStatus::kSuccess).wire_bytes();
  const std::size_t trailer = MakePacket(*this, last, PacketStatus::kSuccess).wire_bytes();
  const std::size_t heads =
      data_packets() * std::size_t{kGvspHeader_bytes + kIpUdpHeader_bytes + kEthernet_bytes};
  return leader + heads + image->size() + chunks.size() + trailer;
}

std::vector<std::uint8_t> MakeChunks(const ChunkSelection& selection, const ChunkValues& values) {
  std::vector<std::uint8_t> chunks;
  if (!selection.active) {
    return chunks;
  }
  Append32(chunks, kImageChunkId);  // the pixels themselves are the first chunk
  Append32(chunks, values.image_bytes);
  if (selection.frame_id) {
    AppendChunk(chunks, kFrameIdChunkId, values.frame_id);
  }
  if (selection.timestamp) {
    AppendChunk(chunks, kTimestampChunkId, values.timestamp_ns);
  }
  if (selection.exposure_time) {
    AppendChunk(chunks, kExposureChunkId, values.exposure_us);
  }
  return chunks;
}

GvspPacket MakePacket(const GvspFrame& frame, std::uint32_t packet_id, PacketStatus status) {
  GvspPacket packet;
  Put16(packet.head, 0, static_cast<std::uint16_t>(status));
  if (packet_id == 0) {
    PutHeader(packet, frame.block_id, kLeaderFormat, packet_id);
    AddLeader(packet, frame);
  } else if (packet_id <= frame.data_packets()) {
    PutHeader(packet, frame.block_id, kDataFormat, packet_id);
    AddData(packet, frame, packet_id);
  } else {
    PutHeader(packet, frame.block_id, kTrailerFormat, packet_id);
    AddTrailer(packet, frame);
  }
  return packet;
}

GvspPacket MakeUnavailable(std::uint16_t block_id, std::uint32_t packet_id) {
  GvspPacket packet;
  Put16(packet.head, 0, static_cast<std::uint16_t>(PacketStatus::kUnavailable));
  PutHeader(packet, block_id, kDataFormat, packet_id);
  return packet;
}

}  // namespace forgescan::gige
