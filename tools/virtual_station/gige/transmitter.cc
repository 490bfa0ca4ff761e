#include "tools/virtual_station/gige/transmitter.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <utility>

#include "tools/virtual_station/gige/mono_time.h"

namespace forgescan::gige {
namespace {

constexpr std::size_t kBatch_packets = 32;
constexpr std::int64_t kBatch_ns = 500'000;  // packets due within this time go out together
constexpr int kCatchUp = 2;                  // a late sender's speed, in multiples of the camera's
constexpr std::size_t kMemory_frames = 4;
constexpr std::size_t kBehind_frames = 64;  // what a machine that cannot keep up may owe
constexpr std::size_t kHistory_frames = 8;
constexpr std::size_t kMemory_resends = 4096;  // requests; a host asks packet by packet for a lost frame
constexpr std::uint32_t kUnknownAnswered_packets = 32;  // of a request for a frame that is not kept

iovec Piece(std::span<const std::uint8_t> bytes) {
  return {const_cast<std::uint8_t*>(bytes.data()), bytes.size()};  // sendmmsg does not write
}

std::int64_t FrameTimeNs(const GvspFrame& frame, double rate_mbit_s) {
  return WireTimeNs(frame.wire_bytes(), rate_mbit_s) + frame.packets() * frame.packet_delay_ns;
}

}  // namespace

// Packets on their way into one system call; owns their heads, keeps their frames alive.
struct Transmitter::Batch {
  struct Entry {
    GvspPacket packet;
    sockaddr_in target;
    std::array<iovec, 3> pieces;
  };
  std::array<Entry, kBatch_packets> entries;
  std::array<mmsghdr, kBatch_packets> messages{};
  std::size_t size = 0;
};

Transmitter::Transmitter(int fd, TransmitterOptions options)
    : fd_(fd), options_(std::move(options)), random_(options_.seed), thread_([this] { Run(); }) {}

Transmitter::~Transmitter() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

bool Transmitter::Submit(std::shared_ptr<const GvspFrame> frame) {
  {
    const std::lock_guard lock(mutex_);
    while (!leave_ns_.empty() && leave_ns_.front() <= frame->ready_ns) {
      leave_ns_.pop_front();
    }
    if (leave_ns_.size() >= kMemory_frames || waiting_.size() >= kBehind_frames) {
      return false;
    }
    const std::int64_t begin_ns = leave_ns_.empty() ? frame->ready_ns : leave_ns_.back();
    leave_ns_.push_back(begin_ns + FrameTimeNs(*frame, options_.rate_mbit_s));
    waiting_.push_back(std::move(frame));
  }
  wake_.notify_one();
  return true;
}

void Transmitter::RequestResend(const ResendRequest& request) {
  {
    const std::lock_guard lock(mutex_);
    if (resends_.size() >= kMemory_resends) {
      return;  // a host asks again
    }
    const auto frame = FindSent(request.block_id);
    const std::uint32_t most = frame != nullptr ? frame->packets() : kUnknownAnswered_packets;
    ResendRequest& taken = resends_.emplace_back(request);
    taken.last_packet = request.first_packet + std::min(request.last_packet - request.first_packet, most - 1);
  }
  wake_.notify_one();
}

std::shared_ptr<const GvspFrame> Transmitter::FindSent(std::uint16_t block_id) const {
  const auto found = std::find_if(history_.begin(), history_.end(),
                                  [&](const auto& frame) { return frame->block_id == block_id; });
  return found != history_.end() ? *found : nullptr;
}

void Transmitter::Forget() {
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  history_.clear();
  resends_.clear();
  active_.reset();
  leave_ns_.clear();
}

void Transmitter::SetFaults(double packet_loss_chance, bool resend_unavailable) {
  const std::lock_guard lock(mutex_);
  packet_loss_chance_ = packet_loss_chance;
  resend_unavailable_ = resend_unavailable;
}

TransmitterCounters Transmitter::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

// The lock is held but while waiting: sending a batch to a local socket takes some 10 us, and Submit can wait
// that long.
void Transmitter::Run() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    if (resends_.empty() && !active_ && !StartFrame()) {
      wake_.wait(lock);
    } else if (NextSendNs() > MonoNowNs()) {
      wake_.wait_until(lock, MonoTimePoint(NextSendNs()));
    } else if (!resends_.empty()) {
      ServeResend();
    } else {
      SendSome();
    }
  }
}

std::int64_t Transmitter::NextSendNs() const { return std::max(port_free_ns_, host_free_ns_); }

bool Transmitter::StartFrame() {
  if (waiting_.empty()) {
    return false;
  }
  active_ = std::move(waiting_.front());
  waiting_.pop_front();
  next_packet_ = 0;
  port_free_ns_ = std::max(port_free_ns_, active_->ready_ns);
  history_.push_back(active_);
  if (history_.size() > kHistory_frames) {
    history_.pop_front();
  }
  return true;
}

void Transmitter::SendSome() {
  Batch batch;
  const std::int64_t begin_ns = port_free_ns_;
  const std::int64_t until_ns = MonoNowNs() + kBatch_ns;
  const std::uint32_t packets = active_->packets();
  for (std::size_t i = 0; i < kBatch_packets && next_packet_ < packets && port_free_ns_ <= until_ns; ++i) {
    Add(batch, *active_, MakePacket(*active_, next_packet_, PacketStatus::kSuccess));
    ++next_packet_;
  }
  SendPaced(batch, begin_ns);
  if (next_packet_ == packets) {
    ++counters_.frames;
    active_.reset();
  }
}

// Resends go before what waits, at the pace of the wire like everything else.
void Transmitter::ServeResend() {
  ResendRequest& request = resends_.front();
  const auto found = FindSent(request.block_id);
  if (history_.empty()) {
    resends_.pop_front();  // nothing was sent since the start: there is not even a host to answer
    return;
  }
  const bool available = found != nullptr && !resend_unavailable_;
  const GvspFrame& frame = available ? *found : *history_.back();
  const std::uint32_t end =
      std::min(request.last_packet + 1, available ? frame.packets() : request.last_packet + 1);
  Batch batch;
  if (!active_) {  // with a frame on its way, or due, the resend takes its turn in a schedule that may be
                   // behind
    const std::int64_t now_ns = MonoNowNs();
    port_free_ns_ =
        std::max(port_free_ns_, waiting_.empty() ? now_ns : std::min(now_ns, waiting_.front()->ready_ns));
  }
  const std::int64_t begin_ns = port_free_ns_;
  for (std::size_t i = 0;
       i < kBatch_packets && request.first_packet < end && port_free_ns_ <= begin_ns + kBatch_ns; ++i) {
    const std::uint32_t packet = request.first_packet++;
    Add(batch, frame,
        available ? MakePacket(frame, packet, PacketStatus::kResent)
                  : MakeUnavailable(request.block_id, packet));
    ++(available ? counters_.packets_resent : counters_.resends_unavailable);
  }
  SendPaced(batch, begin_ns);
  if (request.first_packet >= end) {
    resends_.pop_front();
  }
}

void Transmitter::Add(Batch& batch, const GvspFrame& frame, const GvspPacket& packet) {
  const std::int64_t departs_ns = port_free_ns_;
  port_free_ns_ += WireTimeNs(packet.wire_bytes(), options_.rate_mbit_s) + frame.packet_delay_ns;
  const double draw = static_cast<double>(random_() >> 11) * 0x1p-53;
  if (draw < packet_loss_chance_) {
    ++counters_.packets_lost;
    return;
  }
  if (options_.link && !options_.link->Admit(departs_ns, packet.wire_bytes())) {
    ++counters_.packets_refused;
    return;
  }
  Batch::Entry& entry = batch.entries[batch.size];
  entry.packet = packet;
  entry.target = frame.target;
  entry.pieces = {Piece(std::span(entry.packet.head).first(packet.head_bytes)), Piece(packet.image_part),
                  Piece(packet.chunk_part)};
  msghdr& message = batch.messages[batch.size].msg_hdr;
  message.msg_name = &entry.target;
  message.msg_namelen = sizeof entry.target;
  message.msg_iov = entry.pieces.data();
  message.msg_iovlen = entry.pieces.size();
  ++batch.size;
}

// `begin_ns`: when the batch began to leave by the camera's schedule.
void Transmitter::SendPaced(Batch& batch, std::int64_t begin_ns) {
  Send(batch);
  host_free_ns_ = MonoNowNs() + (port_free_ns_ - begin_ns) / kCatchUp;
}

void Transmitter::Send(Batch& batch) {
  std::size_t done = 0;
  while (done < batch.size) {
    const int sent = ::sendmmsg(fd_, &batch.messages[done], static_cast<unsigned>(batch.size - done), 0);
    if (sent > 0) {
      counters_.packets += static_cast<std::uint64_t>(sent);
      done += static_cast<std::size_t>(sent);
    } else {
      ++counters_.packets_failed;  // the first of the rest was refused; the others get their chance
      ++done;
    }
  }
}

}  // namespace forgescan::gige
