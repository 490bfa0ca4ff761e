// LCM logs written byte by byte, and damaged in known ways: what a reader must still find is known exactly.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "services/common/bus/bus.h"
#include "services/common/log/log_format.h"

namespace forgescan {

struct SyntheticEvent {
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::string channel;
  Bytes message;
  std::uint64_t offset = 0;  // in the file

  std::uint64_t message_offset() const { return offset + kLogHeaderBytes + channel.size(); }
  std::uint64_t end() const { return message_offset() + message.size(); }
};

template <typename Integer>
void AppendBigEndian(Bytes& bytes, Integer value) {
  for (std::size_t i = sizeof value; i-- > 0;) {
    bytes.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
  }
}

inline Bytes EncodedEvent(const SyntheticEvent& event) {
  Bytes bytes;
  AppendBigEndian(bytes, kLogSyncWord);
  AppendBigEndian(bytes, event.number);
  AppendBigEndian(bytes, event.utime);
  AppendBigEndian(bytes, static_cast<std::int32_t>(event.channel.size()));
  AppendBigEndian(bytes, static_cast<std::int32_t>(event.message.size()));
  bytes.insert(bytes.end(), event.channel.begin(), event.channel.end());
  bytes.insert(bytes.end(), event.message.begin(), event.message.end());
  return bytes;
}

// A log and the events that lie in it undivided, in file order.
struct SyntheticLog {
  Bytes bytes;
  std::vector<SyntheticEvent> events;

  void Append(SyntheticEvent event) {
    event.offset = bytes.size();
    const Bytes encoded = EncodedEvent(event);
    bytes.insert(bytes.end(), encoded.begin(), encoded.end());
    events.push_back(std::move(event));
  }
  // Takes bytes out; what follows moves forward.
  void Cut(std::uint64_t from, std::uint64_t to) {
    to = std::min<std::uint64_t>(to, bytes.size());
    std::erase_if(events, [&](const SyntheticEvent& e) { return e.offset < to && e.end() > from; });
    bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(from),
                bytes.begin() + static_cast<std::ptrdiff_t>(to));
    for (SyntheticEvent& event : events) {
      event.offset -= event.offset >= to ? to - from : 0;
    }
  }
  // The bytes of the event, as they are now, are those that were written; `count`: only the first of them.
  bool Holds(const SyntheticEvent& event, std::size_t count = SIZE_MAX) const {
    const Bytes encoded = EncodedEvent(event);
    count = std::min(count, encoded.size());
    return event.end() <= bytes.size() &&
           std::equal(encoded.begin(), encoded.begin() + static_cast<std::ptrdiff_t>(count),
                      bytes.begin() + static_cast<std::ptrdiff_t>(event.offset));
  }
  void WriteTo(const std::filesystem::path& path) const {
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
};

// Bytes of a message: noise with sync words, and with whole headers that would be believed by themselves.
inline Bytes MisleadingMessage(std::mt19937_64& random, std::size_t size) {
  Bytes message;
  while (message.size() < size) {
    const auto kind = random() % 20;
    if (kind == 0) {
      AppendBigEndian(message, kLogSyncWord);
    } else if (kind == 1) {
      SyntheticEvent inner{static_cast<std::int64_t>(random()), 1, "INNER", Bytes(random() % 300), 0};
      Bytes encoded = EncodedEvent(inner);
      encoded.resize(kLogHeaderBytes + inner.channel.size());
      message.insert(message.end(), encoded.begin(), encoded.end());
    } else {
      AppendBigEndian(message, kind < 4 ? 0 : random());
    }
  }
  message.resize(size);
  return message;
}

inline SyntheticLog MakeLog(std::uint64_t seed, int events) {
  std::mt19937_64 random(seed);
  const std::vector<std::string> channels{"A", "FRAME_LEFT", "STATE", "WITH SPACE", std::string(63, 'z')};
  SyntheticLog log;
  for (int i = 0; i < events; ++i) {
    const std::size_t size = random() % 4 == 0 ? random() % 6000 : random() % 200;
    // Not in order, as in real logs.
    const auto utime = 1'700'000'000'000'000 + i * 1000 - static_cast<std::int64_t>(random() % 3000);
    log.Append({i, utime, channels[random() % channels.size()], MisleadingMessage(random, size), 0});
  }
  return log;
}

}  // namespace forgescan
