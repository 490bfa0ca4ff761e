// Times and sizes of the resend protocol, and what it counts.
#pragma once

#include <cstdint>

namespace forgescan {

struct StreamOptions {
  std::int64_t history_bytes = 100'000'000;  // kept per channel whatever its age: two views of one camera
  std::int64_t burst_bytes = 500'000'000;    // kept per channel while younger than give_up_us: a dense cloud
  std::int64_t status_first_us = 20'000;     // after a message; doubled up to status_period_us
  std::int64_t status_period_us = 500'000;   // while nothing is sent
  std::int64_t request_after_us = 30'000;    // a message is asked for when missing this long
  std::int64_t request_period_us = 60'000;   // and again when it, or more of it, has not come for this long
  std::int64_t give_up_us = 10'000'000;      // a message is given up when missing this long without progress
  int requests_at_once = 4;                  // messages of a stream asked for at the same time
  std::int32_t piece_bytes = 48'000;         // of a resent message: one datagram
  std::int64_t piece_gap_us = 150;           // between pieces: a small kernel buffer drains in it
};

struct StreamCounters {
  std::int64_t published = 0;
  std::int64_t delivered = 0;
  std::int64_t missing = 0;     // given up
  std::int64_t recovered = 0;   // arrived by a resend only
  std::int64_t resent = 0;      // messages of ours sent again, counted by request
  std::int64_t duplicates = 0;  // arrived more than once
  std::int64_t damaged = 0;     // wrong CRC or undecodable
};

}  // namespace forgescan
