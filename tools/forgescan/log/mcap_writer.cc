#include "tools/forgescan/log/mcap_writer.h"

#include <libdeflate.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "services/common/new_file.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 4'000'000;
constexpr std::size_t kMaxIds = 65'535;

enum class Op : std::uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kStatistics = 11,
  kSummaryOffset = 14,
  kDataEnd
};

// The specification's types: integers little-endian, everything else with its length before it.
class Content {
 public:
  template <typename Integer>
  Content& Put(Integer value) {
    for (std::size_t i = 0; i < sizeof value; ++i) {
      bytes_.push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i)));
    }
    return *this;
  }
  Content& Text(std::string_view text) { return Put(static_cast<std::uint32_t>(text.size())).Raw(text); }
  Content& Raw(std::string_view bytes) {
    bytes_ += bytes;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string Record(Op op, const Content& content) {
  return Content()
      .Put(static_cast<std::uint8_t>(op))
      .Put(std::uint64_t{content.bytes().size()})
      .Raw(content.bytes())
      .bytes();
}

std::uint32_t Crc(std::uint32_t before, std::string_view bytes) {
  return bytes.empty() ? before : libdeflate_crc32(before, bytes.data(), bytes.size());
}

std::string Joined(const std::vector<std::string>& records) {
  std::string all;
  for (const std::string& record : records) {
    all += record;
  }
  return all;
}

}  // namespace

Result<McapWriter> McapWriter::Create(const std::string& path) {
  const std::string part = path + StagedEnding();
  std::error_code ignored;
  for (const std::string& name : {path, part}) {
    if (fs::exists(fs::symlink_status(name, ignored))) {
      return Fail(ErrorCode::kInvalidArgument, "{}: exists already", name);
    }
  }
  errno = 0;
  std::ofstream file(part, std::ios::binary);
  if (!file) {
    return Fail(ErrorCode::kIo, "{}: cannot be made ({})", part, std::strerror(errno));
  }
  McapWriter writer(path, std::move(file));
  RETURN_IF_ERROR(writer.Put(kMagic));
  RETURN_IF_ERROR(writer.Put(Record(Op::kHeader, Content().Text("").Text("forgescan"))));
  return writer;
}

McapWriter::McapWriter(std::string path, std::ofstream file)
    : path_(std::move(path)), file_(std::move(file)) {}

McapWriter::McapWriter(McapWriter&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::move(other.file_)),
      is_open_(std::exchange(other.is_open_, false)),
      position_(other.position_),
      crc_(other.crc_),
      chunk_(std::move(other.chunk_)),
      schemas_(std::move(other.schemas_)),
      channels_(std::move(other.channels_)),
      chunk_indices_(std::move(other.chunk_indices_)),
      message_counts_(std::move(other.message_counts_)),
      first_ns_(other.first_ns_),
      last_ns_(other.last_ns_),
      messages_(other.messages_) {}

McapWriter::~McapWriter() {
  std::error_code ignored;
  if (is_open_) {
    fs::remove(path_ + StagedEnding(), ignored);
  }
}

Status McapWriter::Put(std::string_view bytes) {
  errno = 0;
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file_) {
    return Fail(ErrorCode::kIo, "{}: cannot be written at byte {} ({})", path_, position_,
                std::strerror(errno));
  }
  position_ += bytes.size();
  crc_ = Crc(crc_, bytes);
  return {};
}

Result<std::uint16_t> McapWriter::AddSchema(std::string_view name, std::string_view data) {
  if (schemas_.size() >= kMaxIds) {
    return Fail(ErrorCode::kInvalidArgument, "an MCAP file holds at most {} schemas", kMaxIds);
  }
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back(Record(Op::kSchema, Content().Put(id).Text(name).Text("jsonschema").Text(data)));
  chunk_.records += schemas_.back();
  return id;
}

Result<std::uint16_t> McapWriter::AddChannel(std::uint16_t schema, std::string_view topic) {
  if (channels_.size() >= kMaxIds) {
    return Fail(ErrorCode::kInvalidArgument, "an MCAP file holds at most {} channels", kMaxIds);
  }
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  const Content content = Content().Put(id).Put(schema).Text(topic).Text("json").Text("");  // no metadata
  channels_.push_back(Record(Op::kChannel, content));
  chunk_.records += channels_.back();
  return id;
}

Status McapWriter::Write(const Message& message, std::string_view data) {
  const std::uint64_t time_ns = message.log_time_ns;
  chunk_.first_ns = chunk_.has_messages ? std::min(chunk_.first_ns, time_ns) : time_ns;
  chunk_.last_ns = std::max(chunk_.last_ns, time_ns);
  chunk_.has_messages = true;
  chunk_.index[message.channel].emplace_back(time_ns, chunk_.records.size());
  first_ns_ = messages_ == 0 ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = std::max(last_ns_, time_ns);
  ++messages_;
  ++message_counts_[message.channel];
  const Content content = Content()
                              .Put(message.channel)
                              .Put(message.sequence)
                              .Put(time_ns)
                              .Put(message.publish_time_ns)
                              .Raw(data);
  chunk_.records += Record(Op::kMessage, content);
  return chunk_.records.size() >= kChunkBytes ? FlushChunk() : Status();
}

Status McapWriter::FlushChunk() {
  const Chunk chunk = std::exchange(chunk_, {});
  if (chunk.records.empty()) {
    return {};
  }
  const std::uint64_t chunk_at = position_, size = chunk.records.size();
  Content head;
  head.Put(chunk.first_ns).Put(chunk.last_ns).Put(size).Put(Crc(0, chunk.records)).Text("").Put(size);
  RETURN_IF_ERROR(Put(Record(Op::kChunk, head.Raw(chunk.records))));
  const std::uint64_t index_at = position_;
  Content offsets;
  for (const auto& [channel, messages] : chunk.index) {
    offsets.Put(channel).Put(position_);
    Content places;
    for (const auto& [time_ns, offset] : messages) {
      places.Put(time_ns).Put(offset);
    }
    RETURN_IF_ERROR(Put(Record(Op::kMessageIndex, Content().Put(channel).Text(places.bytes()))));
  }
  Content index;
  index.Put(chunk.first_ns).Put(chunk.last_ns).Put(chunk_at).Put(index_at - chunk_at).Text(offsets.bytes());
  index.Put(position_ - index_at).Text("").Put(size).Put(size);
  chunk_indices_.push_back(Record(Op::kChunkIndex, index));
  return {};
}

std::string McapWriter::Statistics() const {
  Content counts, content;
  for (const auto& [channel, count] : message_counts_) {
    counts.Put(channel).Put(count);
  }
  content.Put(messages_).Put(static_cast<std::uint16_t>(schemas_.size()));
  content.Put(static_cast<std::uint32_t>(channels_.size()));
  content.Put(std::uint32_t{0}).Put(std::uint32_t{0});  // attachments, metadata
  content.Put(static_cast<std::uint32_t>(chunk_indices_.size()));
  content.Put(first_ns_).Put(last_ns_).Text(counts.bytes());
  return Record(Op::kStatistics, content);
}

Status McapWriter::PutSummary() {
  const std::uint64_t summary_at = position_;
  std::string summary, offsets;
  const std::array<std::pair<Op, std::string>, 4> groups{{{Op::kSchema, Joined(schemas_)},
                                                          {Op::kChannel, Joined(channels_)},
                                                          {Op::kStatistics, Statistics()},
                                                          {Op::kChunkIndex, Joined(chunk_indices_)}}};
  for (const auto& [op, records] : groups) {
    if (records.empty()) {
      continue;
    }
    offsets += Record(Op::kSummaryOffset, Content()
                                              .Put(static_cast<std::uint8_t>(op))
                                              .Put(summary_at + summary.size())
                                              .Put(std::uint64_t{records.size()}));
    summary += records;
  }
  // The footer's own CRC covers the footer up to where it stands.
  constexpr std::uint64_t kFooterBytes = 20;
  Content footer;
  footer.Put(static_cast<std::uint8_t>(Op::kFooter)).Put(kFooterBytes);
  footer.Put(summary_at).Put(summary_at + summary.size());
  summary += offsets + footer.bytes();
  return Put(summary + Content().Put(Crc(0, summary)).Raw(kMagic).bytes());
}

Status McapWriter::Close() {
  RETURN_IF_ERROR(FlushChunk());
  RETURN_IF_ERROR(Put(Record(Op::kDataEnd, Content().Put(crc_))));
  RETURN_IF_ERROR(PutSummary());
  errno = 0;
  file_.close();
  if (!file_) {
    return Fail(ErrorCode::kIo, "{}: cannot be written ({})", path_, std::strerror(errno));
  }
  RETURN_IF_ERROR(RenameToNew(path_ + StagedEnding(), path_));
  is_open_ = false;
  return {};
}

}  // namespace forgescan
