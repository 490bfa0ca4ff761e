// Writes MCAP, the container of Foxglove and others, by its public specification (mcap.dev/spec), version 0:
// uncompressed chunks with message indices, and a summary with statistics, so that a viewer can jump.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

class McapWriter {
 public:
  // The file has StagedEnding() until it is closed. Errors: kInvalidArgument (either exists), kIo.
  static Result<McapWriter> Create(const std::string& path);
  McapWriter(McapWriter&& other) noexcept;
  McapWriter& operator=(McapWriter&&) = delete;
  // Removes the file unless it was closed.
  ~McapWriter();

  // Numbers from 1. data: a schema in JSON. Errors: kInvalidArgument (more than 65535).
  Result<std::uint16_t> AddSchema(std::string_view name, std::string_view data);
  // Of JSON messages. schema: from AddSchema(). Errors: kInvalidArgument (more than 65535).
  Result<std::uint16_t> AddChannel(std::uint16_t schema, std::string_view topic);

  struct Message {
    std::uint16_t channel = 0;  // from AddChannel()
    std::uint32_t sequence = 0;
    std::uint64_t log_time_ns = 0, publish_time_ns = 0;  // since 1970
  };
  // data: JSON. Errors: kIo.
  Status Write(const Message& message, std::string_view data);
  // Errors: kIo.
  Status Close();

 private:
  struct Chunk {
    std::string records;
    std::uint64_t first_ns = 0, last_ns = 0;
    bool has_messages = false;
    // By channel: time and offset in `records` of each message.
    std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> index;
  };
  McapWriter(std::string path, std::ofstream file);
  Status Put(std::string_view bytes);
  Status FlushChunk();
  std::string Statistics() const;
  Status PutSummary();

  std::string path_;
  std::ofstream file_;
  bool is_open_ = true;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  // of all bytes so far
  Chunk chunk_;
  std::vector<std::string> schemas_, channels_, chunk_indices_;  // records for the summary
  std::map<std::uint16_t, std::uint64_t> message_counts_;        // by channel
  std::uint64_t first_ns_ = 0, last_ns_ = 0;
  std::uint64_t messages_ = 0;
};

}  // namespace forgescan
