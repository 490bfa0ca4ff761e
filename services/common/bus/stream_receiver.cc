#include "services/common/bus/stream_receiver.h"

#include <algorithm>
#include <limits>

#include "fsmsg/resend_request_t.hpp"
#include "services/common/bus/codec.h"
#include "services/common/bus/protocol_channels.h"
#include "services/common/bus/stream_header.h"

namespace forgescan {
namespace {

// A sender that claims more than this behind what was delivered is not believed: it would cost unbounded
// memory.
constexpr std::int64_t kMaxWaiting = 100'000;
constexpr std::size_t kMaxPiecesAsked = 2000;
constexpr std::size_t kSessionsLeftKept = 8;  // their datagrams are milliseconds late, restarts seconds apart

}  // namespace

StreamReceiver::StreamReceiver(Bus& bus, std::string channel, const StreamOptions& options,
                               StreamCounters& counters)
    : bus_(bus),
      channel_(std::move(channel)),
      options_(options),
      counters_(counters),
      subscribed_us_(bus.NowUs()) {}

bool StreamReceiver::EnterSession(std::int64_t session, std::int64_t first_sequence_if_joining) {
  if (std::find(left_.begin(), left_.end(), session) != left_.end()) {
    return false;
  }
  heard_us_ = bus_.NowUs();
  if (session == session_) {
    return true;
  }
  // A sender that started after we subscribed is heard from its first message on; an older one from now on.
  // One that follows another has started meanwhile, even if its session is lower because the wall clock was
  // set back.
  const bool from_the_start = session_ != 0 || session >= subscribed_us_;
  if (!waiting_.empty()) {
    GiveUp(waiting_.rbegin()->first + 1);
  }
  if (session_ != 0) {
    left_.push_back(session_);
  } else {
    joined_session_ = session;
    joined_at_ = from_the_start ? 1 : first_sequence_if_joining;
  }
  if (left_.size() > kSessionsLeftKept) {
    left_.pop_front();
  }
  session_ = session;
  next_ = from_the_start ? 1 : first_sequence_if_joining;
  return true;
}

void StreamReceiver::OnMessage(ByteView bytes) {
  const Result<StreamHeader> header = CheckStreamHeader(bytes);
  const bool sane =
      header.ok() && header->sequence >= 1 && header->sequence < std::numeric_limits<std::int64_t>::max();
  if (!sane) {
    ++counters_.damaged;
    return;
  }
  if (!EnterSession(header->session, header->sequence)) {
    return;
  }
  if (header->sequence < next_) {
    ++counters_.duplicates;
    return;
  }
  if (header->sequence == next_ && waiting_.empty()) {  // the usual case: no copy
    ++next_;
    ++counters_.delivered;
    handler_(bytes);
    return;
  }
  NoteUpTo(header->sequence);
  if (const auto found = waiting_.find(header->sequence); found != waiting_.end()) {
    Complete(found->second, bytes);
  }
  DeliverReady();
}

void StreamReceiver::NoteUpTo(std::int64_t last) {
  if (last - next_ >= kMaxWaiting) {
    ++counters_.damaged;
    return;
  }
  const std::int64_t from = waiting_.empty() ? next_ : waiting_.rbegin()->first + 1;
  for (std::int64_t sequence = from; sequence <= last; ++sequence) {
    waiting_[sequence].since_us = bus_.NowUs();
  }
}

void StreamReceiver::Complete(Waiting& waiting, ByteView bytes) {
  if (waiting.complete) {
    ++counters_.duplicates;
    return;
  }
  waiting.bytes.assign(bytes.begin(), bytes.end());
  waiting.complete = true;
  waiting.pieces.clear();
}

void StreamReceiver::OnPiece(const fsmsg::resend_piece_t& piece) {
  const auto found = waiting_.find(piece.sequence);
  const bool sane =
      piece.message_bytes > 0 && static_cast<std::size_t>(piece.message_bytes) <= kMaxMessageBytes &&
      piece.piece_bytes > 0 && piece.piece >= 0 && piece.piece <= piece.message_bytes / piece.piece_bytes;
  if (piece.session != session_ || found == waiting_.end() || found->second.complete || !sane) {
    return;
  }
  Waiting& waiting = found->second;
  const auto bytes = static_cast<std::size_t>(piece.message_bytes),
             size = static_cast<std::size_t>(piece.piece_bytes);
  const std::size_t count = (bytes + size - 1) / size, index = static_cast<std::size_t>(piece.piece);
  if (waiting.pieces.size() != count || waiting.bytes.size() != bytes) {
    waiting.bytes.assign(bytes, 0);
    waiting.pieces.assign(count, false);
    waiting.pieces_open = count;
  }
  const std::size_t begin = index * size;
  if (index >= count || waiting.pieces[index] || piece.data.size() != std::min(size, bytes - begin)) {
    return;
  }
  std::copy(piece.data.begin(), piece.data.end(), waiting.bytes.begin() + static_cast<std::ptrdiff_t>(begin));
  waiting.pieces[index] = true;
  waiting.resent = true;
  waiting.since_us = bus_.NowUs();
  if (--waiting.pieces_open > 0) {
    return;
  }
  const Result<StreamHeader> header = CheckStreamHeader(waiting.bytes);
  if (!header.ok() || header->sequence != piece.sequence) {
    ++counters_.damaged;
    waiting.pieces.clear();  // ask for all of it again
    waiting.bytes.clear();
    return;
  }
  waiting.complete = true;
  DeliverReady();
}

void StreamReceiver::OnStatus(std::int64_t session, std::int64_t first, std::int64_t last) {
  const bool sane =
      first >= 1 && last >= 0 && last < std::numeric_limits<std::int64_t>::max() && first <= last + 1;
  if (!sane) {
    ++counters_.damaged;
    return;
  }
  if (!EnterSession(session, last + 1)) {
    return;
  }
  told_us_ = bus_.NowUs();
  GiveUp(first);  // the sender no longer has what is older
  NoteUpTo(last);
  DeliverReady();
}

void StreamReceiver::DeliverReady() {
  while (!waiting_.empty() && waiting_.begin()->first == next_ && waiting_.begin()->second.complete) {
    const auto node = waiting_.extract(waiting_.begin());
    ++next_;
    ++counters_.delivered;
    counters_.recovered += node.mapped().resent ? 1 : 0;
    handler_(node.mapped().bytes);
  }
}

// Each hole in one step, however long.
void StreamReceiver::GiveUp(std::int64_t before) {
  DeliverReady();
  while (next_ < before) {
    const auto complete = std::find_if(waiting_.begin(), waiting_.end(),
                                       [](const auto& waiting) { return waiting.second.complete; });
    const std::int64_t first = next_;
    next_ = complete == waiting_.end() ? before : std::min(before, complete->first);
    waiting_.erase(waiting_.begin(), waiting_.lower_bound(next_));
    counters_.missing += next_ - first;
    if (lost_handler_) {
      lost_handler_(first, next_ - 1);
    }
    DeliverReady();
  }
}

bool StreamReceiver::IsOverdue(const Waiting& waiting) const {
  const std::int64_t now_us = bus_.NowUs();
  const bool fruitless = waiting.first_asked_us != 0 &&
                         now_us - std::max(waiting.first_asked_us, waiting.since_us) > options_.give_up_us;
  return fruitless || now_us - heard_us_ > options_.give_up_us;
}

void StreamReceiver::OnTimer() {
  std::int64_t give_up_before = next_;
  int open = 0;
  for (auto& [sequence, waiting] : waiting_) {
    if (waiting.complete) {
      continue;
    }
    if (open == 0 && IsOverdue(waiting)) {  // behind one that still comes in pieces it has to wait
      give_up_before = sequence + 1;
    } else if (++open > options_.requests_at_once) {
      break;
    } else {
      AskIfDue(sequence, waiting);
    }
  }
  GiveUp(give_up_before);
}

void StreamReceiver::AskIfDue(std::int64_t sequence, Waiting& waiting) {
  const std::int64_t now_us = bus_.NowUs();
  const bool first_time = waiting.asked_us == 0 && now_us - waiting.since_us >= options_.request_after_us;
  const bool again = waiting.asked_us != 0 &&
                     now_us - std::max(waiting.asked_us, waiting.since_us) >= options_.request_period_us;
  if (!first_time && !again) {
    return;
  }
  waiting.asked_us = now_us;
  waiting.first_asked_us = first_time ? now_us : waiting.first_asked_us;
  fsmsg::resend_request_t request{};
  request.utime = now_us;
  request.channel = channel_;
  request.session = session_;
  request.sequence = sequence;
  for (std::size_t i = 0; i < waiting.pieces.size() && request.pieces.size() < kMaxPiecesAsked; ++i) {
    if (!waiting.pieces[i]) {
      request.pieces.push_back(static_cast<std::int32_t>(i));
    }
  }
  request.piece_count = static_cast<std::int32_t>(request.pieces.size());
  // A request the network refused is repeated after request_period_us.
  [[maybe_unused]] const Status sent = bus_.Publish(kResendRequestChannel, Encode(request));
}

}  // namespace forgescan
